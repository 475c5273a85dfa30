"""The synchronous face: one line, any thread, one command at a time.

The logic is `protocol`'s; here are only the line, time-outs, and a lock.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Sequence
from threading import RLock
from typing import Final, Self, TypeVar

from tmcm34x.host.answer import Answer
from tmcm34x.host.line import Line, open_line
from tmcm34x.host.protocol import QUIET_S, Conversation, WireCounts
from tmcm34x.host.steps import READ_MEMORY, VERSION, Clock, Follow, Pause, Step, Steps, Work, check
from tmcm34x.host.url import parse_url
from tmcm34x.tmcl.datagram import SIZE, Instruction, Reply, pack_request
from tmcm34x.tmcl.status import Status

T = TypeVar("T")
OnTelegram = Callable[[bool, bytes], None]
"""Takes each telegram: whether it was sent, and its bytes."""

_OK: Final = int(Status.OK)


class Connection:
    """A line with modules on it; by default the module at `address`.

    timeout_s: how long to wait for a reply, pause time (parameter 75) included
    retries: how often a command is sent again that only reads, or that the module says has not arrived
    """

    def __init__(self, line: Line, *, address: int = 1, timeout_s: float = 1.0, retries: int = 2) -> None:
        self.line = line
        self.address = address
        self.timeout_s = timeout_s
        self.listeners: list[OnTelegram] = []
        """Called with each telegram."""
        self._conversation = Conversation(retries, self._heard)
        self._lock = RLock()

    @classmethod
    def open(cls, url: str, **defaults: object) -> Self:
        """A connection to `url`, see `url`; `defaults` are options that it does not name.  Raises `LinkError`."""
        name = parse_url(url, **defaults)
        return cls(open_line(name), address=name.address, timeout_s=name.timeout_s, retries=name.retries)

    def close(self) -> None:
        """Hang up."""
        self.line.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    @property
    def counts(self) -> WireCounts:
        """What happened on the line so far: telegrams, retries, late replies."""
        return self._conversation.counts

    @property
    def events(self) -> deque[Reply]:
        """Second replies of command 138 that came on their own, oldest first."""
        return self._conversation.events

    @property
    def retries(self) -> int:
        """How often a command is sent again."""
        return self._conversation.retries

    @retries.setter
    def retries(self, retries: int) -> None:
        self._conversation.retries = retries

    # Commands

    def command(self, number: int, type: int = 0, motor: int = 0, value: int = 0) -> int:  # noqa: A002
        """Have a command executed; returns the value of the reply.  Raises `HostError`."""
        instruction = Instruction(number, type, motor, value)
        answer = self.ask(instruction)
        return answer.value if answer.status == _OK else check(instruction, answer).value

    def execute(self, instruction: Instruction, address: int | None = None) -> Reply:
        """Have `instruction` executed; returns the reply, whose status is 100.

        Raises `RefusedError` for any other status, `ReplyError` when no reply comes, `LinkError`.
        """
        return check(instruction, self.ask(instruction, address)).reply

    def version(self) -> str:
        """Type and version of the firmware, as the module writes it: `343V4.36`."""
        instruction = Instruction(VERSION)
        return check(instruction, self.ask(instruction)).text

    def read_instruction(self, address: int) -> Instruction:
        """The instruction at `address` of the program memory."""
        instruction = Instruction(READ_MEMORY, value=address)
        stored = check(instruction, self.ask(instruction)).stored
        assert stored is not None
        return stored

    def send(self, instruction: Instruction) -> None:
        """Send a command that is never answered, such as 137."""
        with self._lock:
            self._write(pack_request(self.address, instruction))

    def urgent(self, instructions: Sequence[Instruction]) -> None:
        """Send commands at once, from any thread, also while another one waits for a reply; such as STOP and MST.

        Their replies are not waited for, and are not taken for those of later commands.
        """
        for instruction in instructions:
            self._conversation.expect(instruction)
            self._write(pack_request(self.address, instruction))

    def forget(self) -> None:
        """Expect no more replies to earlier commands, as when another module is asked."""
        with self._lock:
            self._conversation.forget()

    def wait(self, seconds: float) -> None:
        """Let time pass; events that come meanwhile are kept."""
        with self._lock:
            self.line.sleep(seconds)
            self._conversation.hear(self.line.waiting())

    def ask(
        self, instruction: Instruction, address: int | None = None, *, retries: int | None = None
    ) -> Answer:
        """Whatever the module answers, refusals included: the one place where the line is used.

        retries: instead of those of the connection
        Raises `NoReplyError`, `GarbledReplyError`, `LinkError`.
        """
        module = self.address if address is None else address
        with self._lock:
            waiting = self.line.waiting()
            if waiting or not self._conversation.clear:
                return self._converse(self._conversation.begin(instruction, module, waiting, retries))
            telegram = pack_request(module, instruction)
            self._write(telegram)
            data = self.line.read(SIZE, self.timeout_s)
            answer = self._conversation.quick(instruction, module, data)
            if answer is None:
                self._conversation.begin(instruction, module, retries=retries)
                return self._converse(self._take(data))
            self._heard(data)
            return answer

    def _converse(self, result: Answer | bytes | None) -> Answer:
        """A conversation to its end; `result` is what to do first."""
        end = self.line.now() + self.timeout_s
        while not isinstance(result, Answer):
            if result:
                self._write(result)
                end = self.line.now() + self.timeout_s
            result = self._next(end)
        return result

    def _next(self, end: float) -> Answer | bytes | None:
        """What the next bytes make, or the end of time."""
        conversation = self._conversation
        left = end - self.line.now()
        if conversation.impatient:
            left = min(left, QUIET_S)
        data = self.line.read(conversation.wanted, left) if left > 0 else b""
        return self._take(data)

    def _take(self, data: bytes) -> Answer | bytes | None:
        return self._conversation.feed(data) if data else self._conversation.expire()

    def _write(self, telegram: bytes) -> None:
        for listener in self.listeners:
            listener(True, telegram)
        self.line.write(telegram)

    def _heard(self, data: bytes) -> None:
        for listener in self.listeners:
            listener(False, data)

    # Operations

    def run(self, steps: Steps[T]) -> T:
        """Drive an operation to its end; see `steps`."""
        with self._lock:
            work = Work(steps)
            while work.step is not None:
                try:
                    answer = self.perform(work.step)
                except BaseException as error:
                    work.throw(error)
                else:
                    work.send(answer)
            return work.result

    def perform(self, step: Step) -> Answer | float | None:
        """Do one step of an operation."""
        match step:
            case Instruction():
                return self.ask(step)
            case Pause(seconds):
                self.wait(seconds)
            case Clock():
                return self.line.now()
            case Follow():
                self.address = self.line.follow(step, self.address)
        return None
