"""Finding modules: ports, bit rates, addresses; also one whose rate or address is forgotten.

Every request is 136 type 1, which changes nothing in any module, and has a reply also in download mode.  On CAN a
module that replies is asked for the identifier of its replies too.  A reply that comes while another address is asked
names its module by the address in it: that one is asked again, and given more time.

Source: manual 6.1, 6.7.36, 8.1 (65, 66, 69, 71).
"""

from __future__ import annotations

from collections.abc import Callable, Generator, Iterator, Sequence
from typing import Final, NamedTuple

from tmcm34x.host.answer import is_whole
from tmcm34x.host.connection import Connection
from tmcm34x.host.exceptions import DownloadModeError, LinkError, ReplyError
from tmcm34x.host.line import open_line
from tmcm34x.host.program import silent
from tmcm34x.host.reading import Value
from tmcm34x.host.steps import NUMBERS, VERSION, Follow, executing, reading
from tmcm34x.host.url import ANY, Url, parse_url
from tmcm34x.tmcl.datagram import SIZE, Instruction
from tmcm34x.tmcl.global_parameters import BAUD_RATES, BY_KEY, CAN_BIT_RATES
from tmcm34x.tmcl.status import Status

ADDRESSES: Final = range(1, 256)
LIKELY_BAUDS: Final = (9600, 115200, 57600, 38400, 19200)
"""Tried first; then the others that a module may have."""
LIKELY_ADDRESSES: Final = 16
FOREIGN_BAUD: Final = 4800
"""No module has this bit rate: a reply at it shows that the port has none, as with USB and pseudo terminals."""
_IDENTIFY: Final = Instruction(VERSION, 1)
_REPLY_ID: Final = Instruction(NUMBERS["GGP"], BY_KEY["can_reply_id"].number)
_BITS: Final = 10
LATENCY_S: Final = 0.03
"""What adapters and computers add to the time that two telegrams take on the wire; the longest reply pause besides."""
PATIENCE_S: Final = 1.0
"""For a reply of a module that has replied already."""
NETWORK_S: Final = 0.12
"""What a network adds besides, and a serial line behind it, whose bit rate is not known here."""


class Found(NamedTuple):
    """A module that replied."""

    url: str
    model: int
    version: str
    address: int


class Try(NamedTuple):
    """One place to look at: a line with bit rate, and an address or identifier."""

    url: Url
    address: int


Progress = Callable[[int, int, str], None]
"""Takes how many of how many places are done, and the present one."""


class SerialPortInfo(NamedTuple):
    """A serial port of this computer, and what is known of it."""

    device: str
    description: str


def described_ports() -> list[SerialPortInfo]:
    """The serial ports of this computer, with what their adapters say of themselves."""
    from serial.tools.list_ports import comports

    return sorted(SerialPortInfo(port.device, _description(port.description)) for port in comports())


def _description(text: str | None) -> str:
    return "" if text in {None, "n/a"} else str(text)


def serial_ports() -> list[str]:
    """The names of the serial ports of this computer."""
    return [port.device for port in described_ports()]


def can_interfaces() -> list[str]:
    """The CAN interfaces that python-can knows; none where it is not installed."""
    try:
        from can.interfaces import VALID_INTERFACES
    except ImportError:
        return []
    return sorted(VALID_INTERFACES)


def plan(
    ports: Sequence[str], *, addresses: Sequence[int] = ADDRESSES, bauds: Sequence[int] = ()
) -> list[Try]:
    """Where to look, the likely places first."""
    return [attempt for port in ports for attempt in _attempts(parse_url(port), addresses, bauds)]


def _attempts(url: Url, addresses: Sequence[int], bauds: Sequence[int]) -> Iterator[Try]:
    if url.is_can:
        rates = (
            [url.can.bitrate] if "bitrate" in url.options else sorted(CAN_BIT_RATES.values(), reverse=True)
        )
        for rate in rates:
            yield from (Try(_any_reply(url).replaced(id=n, bitrate=rate), n & 0xFF) for n in addresses)
        return
    if url.scheme != "serial":
        yield from (Try(url.replaced(address=n), n) for n in addresses)
        return
    rates = [url.baud] if "baud" in url.options else list(bauds or _all_bauds())
    near, far = addresses[:LIKELY_ADDRESSES], addresses[LIKELY_ADDRESSES:]
    for part in (near, far):
        for rate in rates:
            yield from (Try(url.replaced(baud=rate, address=n), n) for n in part)


def _any_reply(url: Url) -> Url:
    """Replies may have any identifier, unless the URL names it."""
    return url if "reply" in url.options else url.replaced(reply=ANY)


def _all_bauds() -> list[int]:
    return [*LIKELY_BAUDS, *(rate for rate in BAUD_RATES if rate not in LIKELY_BAUDS)]


def scan(
    attempts: Sequence[Try],
    progress: Progress = silent,
    failed: Callable[[str], None] = silent,
    pause_s: float = LATENCY_S,
) -> Generator[Found]:
    """Look everywhere in order; `failed` takes a line for each port that cannot be opened.

    pause_s: how long to wait for a reply, beside the time that two telegrams take on the wire
    """
    lines = _Lines(pause_s)
    try:
        for done, attempt in enumerate(attempts):
            port = attempt.url.target
            progress(done, len(attempts), f"{port} address {attempt.address}")
            try:
                yield from lines.find(attempt)
            except LinkError as error:
                lines.give_up(port)
                failed(str(error))
    finally:
        lines.close()
    progress(len(attempts), len(attempts), "")


class _Lines:
    """The line that is open now, opened anew only where the next attempt needs another."""

    def __init__(self, pause_s: float) -> None:
        self._pause_s = pause_s
        self._connection: Connection | None = None
        self._opened = ""
        self._dead: set[str] = set()
        self._only_baud: dict[str, int | None] = {}
        """By port where a module was found: the bit rate of all of them where the port has none, or None."""
        self._unanswered: dict[int, Try] = {}
        """By address: what was asked on the line that is open, without a reply in time."""
        self._late: list[Try] = []
        """Those of which the reply came later, while another address was asked."""

    def find(self, attempt: Try) -> Iterator[Found]:
        """The module that replies there, and those whose replies to earlier questions came only now.

        Raises `LinkError`.
        """
        yield from self._find(attempt)
        while self._late:
            yield from self._find(self._late.pop(), PATIENCE_S)

    def _find(self, attempt: Try, patience_s: float = 0.0) -> Iterator[Found]:
        found = self._replying(attempt, patience_s)
        if found is not None:
            yield found
        else:
            self._unanswered[attempt.address] = attempt

    def _replying(self, attempt: Try, patience_s: float) -> Found | None:
        """The module that replies there; a port without a bit rate is looked at once."""
        url = attempt.url
        if self._only_baud.get(url.target) not in {None, url.baud}:
            return None
        found = self.ask(attempt, patience_s)
        if found is not None and url.scheme == "serial" and url.target not in self._only_baud:
            foreign = self.ask(attempt._replace(url=url.replaced(baud=FOREIGN_BAUD)), PATIENCE_S)
            self._only_baud[url.target] = None if foreign is None else url.baud
        return found

    def ask(self, attempt: Try, patience_s: float = 0.0) -> Found | None:
        """Whether a module replies there, in this time at least.  Raises `LinkError`."""
        if attempt.url.target in self._dead:
            return None
        if self._connection is None or self._opened != _line_of(attempt.url):
            self.close()
            self._connection = Connection(open_line(attempt.url), retries=0)
            self._connection.listeners.append(self._hear)
            self._opened = _line_of(attempt.url)
        self._connection.timeout_s = max(_travel_s(attempt.url) + self._pause_s, patience_s)
        return _ask(self._connection, attempt)

    def _hear(self, sent: bool, data: bytes) -> None:
        """Note whose reply came late; a telegram may lie anywhere in what came."""
        if sent:
            return
        for start in range(len(data) - SIZE + 1):
            window = data[start : start + SIZE]
            if _is_identity(window) and window[1] in self._unanswered:
                self._late.append(self._unanswered.pop(window[1]))

    def give_up(self, port: str) -> None:
        """Try a port no more."""
        self._dead.add(port)
        self.close()

    def close(self) -> None:
        """Close what is open."""
        if self._connection is not None:
            self._connection.close()
            self._connection = None
        self._unanswered.clear()
        self._late.clear()


def _line_of(url: Url) -> str:
    """What has to be opened anew for the next attempt: everything but address and identifier."""
    options = {name: value for name, value in url.options.items() if name not in {"address", "id"}}
    return f"{url.scheme}:{url.target}?{sorted(options.items())}"


def _is_identity(window: bytes) -> bool:
    """Whether nine bytes are a reply to the question."""
    return is_whole(window) and window[2] == Status.OK and window[3] == VERSION


def _travel_s(url: Url) -> float:
    """How long a request and its reply are on their way."""
    if url.is_can:
        return 0.0
    return 2 * SIZE * _BITS / url.baud if url.scheme in {"serial", "virtual"} else NETWORK_S


def _ask(connection: Connection, attempt: Try) -> Found | None:
    if attempt.url.is_can:
        connection.line.follow(Follow(can_id=attempt.url.can.id), attempt.address)
    connection.address = attempt.address
    connection.forget()
    try:
        answer = connection.ask(_IDENTIFY)
    except ReplyError:
        return None
    model = answer.value >> 16
    version = f"V{answer.value >> 8 & 0xFF}.{answer.value & 0xFF}"
    return Found(_reply_named(connection, attempt.url).name, model, version, attempt.address)


def _reply_named(connection: Connection, url: Url) -> Url:
    """The URL with the identifier of the module's replies, which the module tells."""
    if url.options.get("reply") != ANY:
        return url
    connection.timeout_s = PATIENCE_S
    try:
        connection.run(executing())  # In download mode it would store the question.
        found = connection.run(reading(_REPLY_ID))
    except (DownloadModeError, ReplyError):
        return url
    return url.replaced(reply=found.value) if isinstance(found, Value) else url
