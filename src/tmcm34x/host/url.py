"""Names of lines: where a module is and how to talk to it, in one text.

    serial:/dev/ttyUSB0?baud=9600&address=1      a serial port; `serial:` may be left out
    tcp:192.168.1.7:17000?address=1              a socket; HOST:PORT alone will do
    can:socketcan:can0?id=1&reply=2              a CAN interface of python-can
    slcan:/dev/ttyACM0?id=1&reply=2              a CAN adapter that speaks SLCAN
    virtual:343?bench=stage.toml                 a module in this process, in virtual time
    rfc2217://host:port?baud=9600                any other URL that pyserial opens

Options that are numbers may be decimal or 0x...; `timeout` is in seconds.  On CAN, `reply=any` takes replies with any
identifier, and `address` is that in the replies of a module that is called by its second identifier (83): the low byte
of its first.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Final, NamedTuple

from tmcm34x.host.exceptions import LinkError
from tmcm34x.tmcl.global_parameters import BY_KEY

ANY: Final = "any"
"""As the identifier of replies: frames with any identifier are taken for one, as where it is not known yet."""
_DEFAULT_BIT_RATE: Final = 1_000_000
_EXAMPLES: Final = (
    "serial:/dev/ttyUSB0?baud=9600&address=1, tcp:HOST:PORT, can:INTERFACE:CHANNEL?id=1, virtual:343"
)


class Can(NamedTuple):
    """Identifiers of a module and of its replies, and the bit rate of the bus."""

    id: int
    reply: int | None
    """None: any."""
    bitrate: int


class Url(NamedTuple):
    """A line by name; `options` are those that were given."""

    scheme: str
    target: str
    options: Mapping[str, str]
    text: str

    @property
    def baud(self) -> int:
        """Bits per second of a serial port."""
        return self._number("baud", 9600, 50, 10_000_000)

    @property
    def address(self) -> int:
        """Address of the module in its replies; on CAN the low byte of its identifier by default.

        A module that is called by its second identifier (83) answers with the low byte of its first (71).
        """
        default = self.can.id & 0xFF if self.is_can else BY_KEY["serial_address"].default
        return self._number("address", default, 0, 255)

    @property
    def timeout_s(self) -> float:
        """How long to wait for a reply."""
        try:
            seconds = float(self.options.get("timeout", "1"))
        except ValueError:
            seconds = 0.0
        if not 0 < seconds <= 3600:
            raise LinkError(f"{self.text}: timeout is a number of seconds above 0")
        return seconds

    @property
    def retries(self) -> int:
        """How often a command is sent again."""
        return self._number("retries", 2, 0, 1000)

    @property
    def can(self) -> Can:
        """What a CAN line needs."""
        highest, any_reply = BY_KEY["can_id"].high, self.options.get("reply") == ANY
        return Can(
            self._number("id", BY_KEY["can_id"].default, 0, highest),
            None if any_reply else self._number("reply", BY_KEY["can_reply_id"].default, 0, highest),
            self._number("bitrate", _DEFAULT_BIT_RATE, 10_000, 1_000_000),
        )

    @property
    def is_can(self) -> bool:
        """Whether the line is a CAN bus, where identifiers stand for addresses."""
        return self.scheme in {"can", "slcan"}

    @property
    def name(self) -> str:
        """The line by name with the options as they are, which may be others than in `text`."""
        options = "&".join(f"{name}={value}" for name, value in self.options.items())
        return f"{self.scheme}:{self.target}" + (f"?{options}" if options else "")

    @property
    def place(self) -> str:
        """Port, bit rate and address, for people."""
        if self.is_can:
            can = self.can
            replies = ANY if can.reply is None else can.reply
            return (
                f"{self.scheme}:{self.target}, {can.bitrate // 1000} kbit/s, id {can.id}, replies {replies}"
            )
        port = self.target if self.scheme == "serial" else f"{self.scheme}:{self.target}"
        rate = f", {self.baud} baud" if self.scheme == "serial" and "://" not in self.target else ""
        return f"{port}{rate}, address {self.address}"

    @property
    def checks(self) -> str:
        """What to check when no reply comes."""
        if self.is_can:
            return "power, wiring and termination, bit rate and identifiers"
        rate = "bit rate" if self.scheme == "serial" else "the bit rate of the converter"
        return f"power, wiring, address and {rate}"

    def replaced(self, **options: object) -> Url:
        """The same line with other options."""
        return self._replace(
            options={**self.options, **{name: str(value) for name, value in options.items()}}
        )

    def _number(self, name: str, default: int, low: int, high: int) -> int:
        text = self.options.get(name)
        if text is None:
            return default
        try:
            number = int(text, 0)
        except ValueError:
            number = low - 1
        if not low <= number <= high:
            raise LinkError(f"{self.text}: {name} is a number from {low} to {high}, not {text!r}")
        return number


_COMMON: Final = frozenset({"timeout", "retries"})
_OPTIONS: Final[Mapping[str, frozenset[str]]] = {
    "serial": _COMMON | {"baud", "address"},
    "tcp": _COMMON | {"address"},
    "can": _COMMON | {"id", "reply", "bitrate", "address"},
    "slcan": _COMMON | {"id", "reply", "bitrate", "address"},
    "virtual": _COMMON | {"address", "bench", "seed", "eeprom", "baud"},
}


def _is_tcp(target: str) -> bool:
    host, _, port = target.rpartition(":")
    return port.isdecimal() and int(port) <= 65535 and "/" not in host and "\\" not in host


_TARGETS: Final[Mapping[str, tuple[Callable[[str], bool], str]]] = {
    "serial": (bool, "the name of a port"),
    "tcp": (_is_tcp, "HOST:PORT with a port up to 65535"),
    "can": (lambda target: all(target.partition(":")), "INTERFACE:CHANNEL, as python-can names them"),
    "slcan": (bool, "the name of a port"),
    "virtual": (lambda target: target in {"341", "342", "343", ""}, "341, 342 or 343"),
}


def parse_url(text: str, **defaults: object) -> Url:
    """Take the name of a line apart.  Raises `LinkError` with what is wrong.

    defaults: options for where the text has none; those that the scheme does not have are left out
    """
    scheme, target, query = _split(text)
    fits, what = _TARGETS[scheme]
    if not fits(target):
        raise LinkError(f"{text}: behind {scheme}: comes {what}")
    try:
        options = _options(query) if query else {}
    except ValueError:
        raise LinkError(f"{text}: options are NAME=VALUE with & between them") from None
    for name in options:
        if name not in _OPTIONS[scheme]:
            known = ", ".join(sorted(_OPTIONS[scheme]))
            raise LinkError(f"{text}: {scheme} has no option {name!r}; it has {known}")
    known = {name: str(value) for name, value in defaults.items() if name in _OPTIONS[scheme]}
    url = Url(scheme, target, {**known, **options}, text)
    _ = url.baud, url.address, url.timeout_s, url.retries, url.can
    return url


def _options(query: str) -> dict[str, str]:
    from urllib.parse import parse_qsl

    return dict(parse_qsl(query, strict_parsing=True, keep_blank_values=True))


def _split(text: str) -> tuple[str, str, str]:
    """Scheme, target and options; a name without scheme is a socket or a serial port by its form."""
    name, _, query = text.partition("?")
    if not name:
        raise LinkError(f"no port is named; examples: {_EXAMPLES}")
    scheme, _, rest = name.partition(":")
    if scheme in _TARGETS:
        return scheme, rest.removeprefix("//") if scheme == "tcp" else rest, query
    if "://" in name:
        return "serial", name, query
    host, _, _ = name.rpartition(":")
    return ("tcp" if host and _is_tcp(name) else "serial"), name, query
