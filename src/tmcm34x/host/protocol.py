"""Telegrams to a module and its replies back, without any line: bytes in, bytes and answers out.

The wire is strictly request and reply, and a module answers in order; but lines are not perfect.  Bytes may be stray,
lost or wrong, and the reply to a command given up may come late.  So

- a reply is looked for in what comes, byte by byte: the right sum, from the right module, to the right command;
- what was sent and not answered is remembered.  A reply belongs to the first of these that it fits, so that a late
  one is never taken for the answer to a later command; where it could be, a probe with another command number goes
  first, behind whose reply nothing late can come.  What stops a motor or the program does not wait for a probe;
- what only reads is sent again.  Anything else is sent again only when the module says that it did not arrive (status
  1); whoever sends it decides what to do about silence;
- the second reply of command 138 is an event, whenever it comes.

One `Conversation` serves all faces of the library; see `connection` and `aio` for those that have a line.

Source: manual 6.1, 6.2, 6.7.34, 6.7.36; the form of 134's reply: fidelity FW-82; order of replies: manual 6.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from typing import Final, NamedTuple

from tmcm34x.host.answer import (
    ADDRESS_CHANGE,
    DAMAGED,
    GET_STATUS,
    GIO,
    OWN_FORMS,
    PLAIN,
    READ_MEMORY,
    REFUSALS,
    VERSION,
    VERSION_TEXT,
    WRONG_CHECKSUM,
    Answer,
    decode,
    failure,
    is_event,
    is_whole,
    normal,
    repeatable,
    stopping,
)
from tmcm34x.host.counts import WireCounts
from tmcm34x.host.exceptions import ReplyError
from tmcm34x.tmcl.datagram import SIZE, TELEGRAM, Instruction, Reply, pack_request, unpack_reply
from tmcm34x.tmcl.status import STATUS_TEXTS

QUIET_S: Final = 0.1
"""After bytes that are no reply: how long to wait for more before something that only reads is sent again."""
DOUBTS: Final = 6
"""How often an answer to 134 that may be the report of a damaged telegram is asked for again."""


class _Sent(NamedTuple):
    """A telegram whose reply has not come."""

    request: object
    number: int


class Conversation:
    """One command after the other with the modules on a line.

    A driver sends what `begin` gives, then what comes goes into `receive` and the end of time into `expire`; each
    gives back an `Answer`, bytes to send, or None to wait on.  `wanted` is how many bytes are worth waiting for.

    retries: how often a command is sent again
    heard: takes each whole telegram that comes, and bytes that are none
    """

    def __init__(self, retries: int = 2, heard: Callable[[bytes], None] = lambda _: None) -> None:
        self.retries = retries
        self._heard = heard
        self.counts = WireCounts()
        self.events: deque[Reply] = deque(maxlen=100)
        """Second replies of command 138, oldest first."""
        self._owed: deque[_Sent] = deque(maxlen=64)
        self._buffer = bytearray()
        self._start: int = 0
        self._host_address: int | None = None
        self._instruction = Instruction(0)
        self._telegram = b""
        self._addresses: tuple[int, ...] = ()
        self._request: object = None
        self._probe: bytes = b""
        self._probing: object = None
        """What the telegrams of the probe are owed as."""
        self._left = 0
        self._doubts = 0
        self._late = False
        self._misdirected = False
        self._origin: int = 0
        """Where what came since the telegram was sent, whole telegrams aside, begins."""

    @property
    def clear(self) -> bool:
        """Whether nothing is left of earlier commands: no reply is owed."""
        return not self._owed

    def expect(self, instruction: Instruction) -> None:
        """A command was sent beside this conversation, perhaps by another thread: its reply comes some time."""
        self.counts.sent += 1
        self._owed.append(_Sent(object(), instruction.number))

    @property
    def _unanswered(self) -> tuple[_Sent, ...]:
        """What is owed now: another thread may `expect` more while this one looks."""
        return tuple(self._owed)

    def forget(self) -> None:
        """Expect no more replies to earlier commands."""
        self._owed.clear()

    def begin(
        self, instruction: Instruction, address: int, waiting: bytes = b"", retries: int | None = None
    ) -> bytes:
        """Begin with a command; `waiting` is what came since the last one.  Returns what to send."""
        if waiting:
            self.hear(waiting)
        self._buffer.clear()
        self._start = 0
        self._origin = 0
        self._instruction, self._telegram = instruction, pack_request(address, instruction)
        self._addresses = (
            (address, instruction.value & 0xFF) if instruction[:3] == ADDRESS_CHANGE else (address,)
        )
        self._left, self._late, self._misdirected = self.retries if retries is None else retries, False, False
        self._doubts = DOUBTS if self._left else 0
        same = repeatable(instruction) or stopping(instruction)
        self._request = (address, instruction) if same else object()
        if not stopping(instruction) and self._ambiguous(instruction.number):
            return self._begin_probe(address)
        return self._send()

    def quick(self, instruction: Instruction, address: int, data: bytes) -> Answer | None:
        """The answer if `data` is nine bytes that answer a command sent on a clear line; the usual case, fast."""
        if len(data) != SIZE:
            return None
        host, module, status, number, value, check = TELEGRAM.unpack(data)
        if (
            module != address
            or number != instruction[0]
            or status not in PLAIN
            or number in OWN_FORMS
            or (sum(data) - 2 * check) & 0xFF
        ):
            return None
        self.counts.sent += 1
        self._host_address = host
        return Answer(status, value, data)

    @property
    def wanted(self) -> int:
        """How many more bytes could make a reply whole."""
        return max(1, SIZE - len(self._buffer) + self._start)

    @property
    def impatient(self) -> bool:
        """Whether bytes came that are no reply, and waiting longer than `QUIET_S` for more makes no sense."""
        return len(self._buffer) >= SIZE or (bool(self._buffer) and self._may_repeat)

    @property
    def _may_repeat(self) -> bool:
        return self._left > 0 and (bool(self._probe) or repeatable(self._instruction))

    def feed(self, data: bytes) -> Answer | bytes | None:
        """Take bytes from the line."""
        self._buffer += data
        while self._start + SIZE <= len(self._buffer):
            window = bytes(self._buffer[self._start : self._start + SIZE])
            found = self._take(window)
            if isinstance(found, Answer):
                self.hear(bytes(self._buffer[self._start :]))  # an event may follow at once
            if found is not None:
                return found
        return None

    def expire(self) -> bytes:
        """Nothing more came in time: gives what to send again, or raises `ReplyError`."""
        if self._start < len(self._buffer) or self._start != self._origin:
            self.counts.garbled += 1
            self._heard(bytes(self._buffer[self._origin :]))
        if self._may_repeat:
            self._left -= 1
            self.counts.retried += 1
            if self._probe:
                self._owed.append(_Sent(self._probing, self._probe[1]))
                return self._probe
            if self._instruction.number in OWN_FORMS:
                self._origin = len(self._buffer)
                self._start = self._origin
            return self._send()
        if self._probe and not repeatable(self._instruction):
            self._probe = b""
            return self._send()
        raise self._failure()

    # What comes

    def _take(self, window: bytes) -> Answer | bytes | None:
        """Look at nine bytes: a reply moves on by nine, anything else by one."""
        if self._probe:
            return self._take_probe(window)
        own = self._own_form(window)
        if own is not None:
            self._skip()
            return self._doubted(window) if self._is_doubtful(window) else self._answered(own)
        if not is_whole(window):
            self._start += 1
            return None
        if is_event(window):
            self._take_event(window)
        elif window[1] not in self._addresses or window[2] not in STATUS_TEXTS:
            self._start += 1
        elif window[2] == WRONG_CHECKSUM or self._is_ours(window[3]):
            return self._take_reply(window)
        else:
            self._take_other(window)
        return None

    def _is_ours(self, number: int) -> bool:
        """Whether a reply to command `number` answers this request, and none before it."""
        first = next((sent.request for sent in self._unanswered if sent.number == number), None)
        return number == self._instruction.number and first == self._request

    def _take_reply(self, window: bytes) -> Answer | bytes | None:
        self._skip()
        self._host_address = window[0]
        if window[2] == WRONG_CHECKSUM:
            return self._damaged(window)
        return self._answered(normal(window))

    def _damaged(self, window: bytes) -> Answer | bytes | None:
        """The module says that a telegram arrived damaged: the first that is not answered."""
        if self._owed and self._owed[0].request != self._request:
            self._owed.popleft()
            self.counts.late += 1
            return None
        answer = self._answered(normal(window))
        if not self._left:
            return answer
        self._left -= 1
        self.counts.retried += 1
        return self._send()

    def _take_other(self, window: bytes) -> None:
        """A whole reply of our module to another command: late if we sent it, else another host's."""
        self._skip()
        for index, sent in enumerate(self._unanswered):
            if sent.request != self._request and sent.number == window[3]:
                for _ in range(index + 1):
                    self._owed.popleft()
                self.counts.late += 1
                self._late = True
                return
        self.counts.misdirected += 1
        self._misdirected = True

    def _skip(self) -> None:
        """A whole telegram is over."""
        self._heard(bytes(self._buffer[self._start : self._start + SIZE]))
        if self._origin == self._start:
            self._origin += SIZE
        self._start += SIZE

    def _take_event(self, window: bytes) -> None:
        self._skip()
        self.counts.events += 1
        self.events.append(unpack_reply(window))

    def _own_form(self, window: bytes) -> Answer | None:
        """The answer to 134 or 136, which have neither status nor command in them."""
        number, type_ = self._instruction[:2]
        if number == VERSION and type_ == 0 and VERSION_TEXT.match(window[1:]):
            return decode(self._instruction, window)
        return self._stored(window) if number == READ_MEMORY else None

    def _stored(self, window: bytes) -> Answer | None:
        """The answer to 134: only its place tells it from noise, the first bytes after whole telegrams."""
        if self._start != self._origin or not is_whole(window) or self._is_refusal(window):
            return None
        if self._host_address not in {None, window[0]}:
            return None
        return decode(self._instruction, window)

    def _is_doubtful(self, window: bytes) -> bool:
        """Whether an answer to 134 may as well be the report of a damaged telegram: it is asked for again.

        On the module with address 6 the stored command GAP 1, 0 looks like that.
        """
        return self._doubts > 0 and window[1] in self._addresses and window[2:8] == DAMAGED

    def _doubted(self, window: bytes) -> Answer | bytes | None:
        """Ask again, beside the other retries: what is stored is the same each time."""
        self._doubts -= 1
        self._left += 1
        return self._damaged(window)

    def _is_refusal(self, window: bytes) -> bool:
        """Whether an answer to 134 has the normal form: then the module has not read anything."""
        return window[1] in self._addresses and window[3] == READ_MEMORY and window[2] in REFUSALS

    def _answered(self, answer: Answer) -> Answer:
        """The reply belongs to the first telegram of this request; what was sent before it has lost its reply."""
        while self._owed and self._owed[0].request != self._request:
            self._owed.popleft()
        if self._owed:
            self._owed.popleft()
        return answer

    # Probes

    def _ambiguous(self, number: int) -> bool:
        """Whether a late reply could be taken for the answer to command `number`."""
        if number in OWN_FORMS:
            return any(sent.request != self._request for sent in self._unanswered)
        return any(sent.number == number and sent.request != self._request for sent in self._unanswered)

    def _begin_probe(self, address: int) -> bytes:
        number = VERSION if all(sent.number != VERSION for sent in self._unanswered) else GET_STATUS
        if any(sent.number == number for sent in self._unanswered):
            number = GIO
        self._probe = pack_request(address, Instruction(number, int(number == VERSION)))
        self._probing = object()
        self._owed.append(_Sent(self._probing, number))
        self.counts.sent += 1
        return self._probe

    def _take_probe(self, window: bytes) -> bytes | None:
        if not is_whole(window) or window[1] not in self._addresses:
            self._start += 1
        elif is_event(window):
            self._take_event(window)
        elif window[3] == self._probe[1]:
            self._skip()
            self._forget_before(self._probing)
            self._probe = b""
            self._buffer.clear()
            self._start = 0
            self._origin = 0
            return self._send()
        else:
            self._skip()
            self.counts.late += 1
            self._late = True
        return None

    def _forget_before(self, request: object) -> None:
        """The first telegram of a request is answered: nothing sent before it will be any more."""
        while self._owed and self._owed.popleft().request is not request:
            pass

    # Failing

    def _failure(self) -> ReplyError:
        self._probe = b""
        return failure(self._instruction, bytes(self._buffer), late=self._late, misdirected=self._misdirected)

    # Sending

    def _send(self) -> bytes:
        self._owed.append(_Sent(self._request, self._instruction.number))
        self.counts.sent += 1
        return self._telegram

    def hear(self, data: bytes) -> None:
        """Take bytes that came while nothing was asked: events, and replies that are late."""
        start = 0
        while start + SIZE <= len(data):
            window = data[start : start + SIZE]
            if not is_whole(window):
                start += 1
                continue
            start += SIZE
            self._heard(window)
            if is_event(window):
                self.counts.events += 1
                self.events.append(unpack_reply(window))
            else:
                self._forget(window[3])

    def _forget(self, number: int) -> None:
        for index, sent in enumerate(self._unanswered):
            if sent.number == number:
                for _ in range(index + 1):
                    self._owed.popleft()
                self.counts.late += 1
                return
