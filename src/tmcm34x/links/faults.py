"""Faults of a line, by name: what goes wrong between a host and a module, on request and repeatably.

A fault is written `NAME[=VALUE][,count=N][,probability=P][,for=SECONDS][,after=N]`:

count         how many requests or replies it strikes; without it, all (`disconnect` and `unplug`: one)
probability   0 < P <= 1 of striking each, drawn from the seed
for           seconds after which it ends by itself; `unplug`: seconds until the line is plugged in again
after         how many requests or replies pass before it begins

The table `KINDS` says whether a fault strikes on requests or on replies and what it does.  On a CAN bus only the kinds
with `can` strike: a damaged frame does not get through a real one either.  `faulty` puts faults in force on lines.
"""

from __future__ import annotations

import random
from collections.abc import Callable, Iterable
from typing import Final, Literal, NamedTuple

from tmcm34x.tmcl.datagram import SIZE, pack_reply, unpack_reply


class FaultError(ValueError):
    """A fault that does not exist or cannot be as written; one line."""


class Piece(NamedTuple):
    """Bytes of a reply and how long they wait [s]."""

    data: bytes
    delay_s: float = 0.0


Change = Callable[[random.Random, float, bytes], Iterable[Piece]]
"""Makes of one reply what arrives of it, given the fault's value."""


class Kind(NamedTuple):
    """One row of `KINDS`.

    strikes: on requests, on replies, or on the whole line
    unit, default, low, high: of the value; "" where there is none, a default of None where it must be given
    can: whether it strikes on a CAN bus too
    change: of faults on replies
    """

    name: str
    strikes: Literal["request", "reply", "line"]
    unit: str
    default: float | None
    low: float
    high: float
    can: bool
    change: Change | None
    help: str


class Fault(NamedTuple):
    """A fault as asked for; see the module's text.  Made by `fault` or `parse`, which check it."""

    kind: Kind
    value: float
    at_most: int | None = None
    probability: float = 1.0
    duration_s: float | None = None
    after: int = 0

    def __str__(self) -> str:
        value = f"={self.value:g}" if self.kind.unit else ""
        return f"{self.kind.name}{value}" + "".join(
            f",{name}={number:g}"
            for name, number, plain in self._options()
            if number != plain and number is not None
        )

    def _options(self) -> tuple[tuple[str, float | None, float | None], ...]:
        return (
            ("count", self.at_most, 1 if self.kind.strikes == "line" else None),
            ("probability", self.probability, 1.0),
            ("for", self.duration_s, None),
            ("after", self.after, 0),
        )


def kind_named(name: str) -> Kind:
    """The row of `KINDS` with this name; raises `FaultError`."""
    kind = BY_NAME.get(name)
    if kind is None:
        raise FaultError(f"there is no fault {name!r}; there are {', '.join(BY_NAME)}")
    return kind


def fault(
    name: str,
    value: float | None = None,
    *,
    count: int | None = None,
    probability: float = 1.0,
    duration_s: float | None = None,
    after: int = 0,
) -> Fault:
    """The fault `name`; raises `FaultError` for what does not exist or is out of range."""
    kind = kind_named(name)
    if not 0 < probability <= 1:
        raise FaultError(f"{name}: probability must be more than 0 and at most 1, not {probability:g}")
    if (count is not None and count < 1) or after < 0:
        raise FaultError(f"{name}: count must be 1 or more, and after 0 or more")
    if duration_s is not None and not 0 < duration_s < 1e9:
        raise FaultError(f"{name}: for must be a number of seconds, more than 0, not {duration_s:g}")
    if count is None and kind.strikes == "line":
        count = 1
    return Fault(kind, _value(kind, value), count, probability, duration_s, after)


def _value(kind: Kind, value: float | None) -> float:
    if not kind.unit:
        if value is not None:
            raise FaultError(f"{kind.name} takes no value")
        return 0.0
    number = kind.default if value is None else value
    if number is None:
        raise FaultError(f"{kind.name} needs a value: {kind.name}={kind.unit}")
    if not kind.low <= number <= kind.high:
        raise FaultError(f"{kind.name}: {kind.unit} must be {kind.low:g}..{kind.high:g}, not {number:g}")
    return number


def parse(text: str) -> Fault:
    """The fault that `text` names; raises `FaultError`."""
    head, *options = text.split(",")
    name, equals, value = head.partition("=")
    given: dict[str, float] = {}
    for option in options:
        key, _, number = option.partition("=")
        if key not in _OPTIONS:
            raise FaultError(f"{name}: {option!r} is none of {', '.join(f'{key}=' for key in _OPTIONS)}")
        given[_OPTIONS[key]] = _number(name, option, number)
    for whole in ("count", "after"):
        if given.get(whole, 0.0) % 1:
            raise FaultError(f"{name}: {whole} must be a whole number, not {given[whole]:g}")
    return fault(
        name,
        _number(name, head, value) if equals else None,
        count=int(given["count"]) if "count" in given else None,
        probability=given.get("probability", 1.0),
        duration_s=given.get("duration_s"),
        after=int(given.get("after", 0)),
    )


_OPTIONS: Final = {"count": "count", "probability": "probability", "for": "duration_s", "after": "after"}


def _number(name: str, where: str, text: str) -> float:
    try:
        number = float(text)
    except ValueError:
        raise FaultError(f"{name}: {where!r} needs a number") from None
    if not abs(number) < 1e12:
        raise FaultError(f"{name}: {where!r} is out of range")
    return number


# What becomes of a reply


def _plain(data: bytes) -> tuple[Piece]:
    return (Piece(data),)


def _bad_checksum(draw: random.Random, _: float, data: bytes) -> Iterable[Piece]:
    return _plain(data[:-1] + bytes((data[-1] ^ draw.randrange(1, 256),)))


def _garble(draw: random.Random, count: float, data: bytes) -> Iterable[Piece]:
    damaged = bytearray(data)
    for place in draw.sample(range(len(data)), min(int(count), len(data))):
        damaged[place] ^= draw.randrange(1, 256)
    return _plain(bytes(damaged))


def _drop(draw: random.Random, count: float, data: bytes) -> Iterable[Piece]:
    lost = set(draw.sample(range(len(data)), min(int(count), len(data))))
    left = bytes(byte for place, byte in enumerate(data) if place not in lost)
    return _plain(left) if left else ()


def _duplicate(_: random.Random, __: float, data: bytes) -> Iterable[Piece]:
    return Piece(data), Piece(data)


def _split(draw: random.Random, pause_ms: float, data: bytes) -> Iterable[Piece]:
    if len(data) < 2:
        return _plain(data)
    cut = draw.randrange(1, len(data))
    return Piece(data[:cut]), Piece(data[cut:], pause_ms / 1000)


def _stray(draw: random.Random, count: float, data: bytes) -> Iterable[Piece]:
    return Piece(draw.randbytes(int(count))), Piece(data)


def _delay(_: random.Random, delay_ms: float, data: bytes) -> Iterable[Piece]:
    return (Piece(data, delay_ms / 1000),)


def _wrong_address(draw: random.Random, _: float, data: bytes) -> Iterable[Piece]:
    try:
        reply = unpack_reply(data)
    except ValueError:
        return _plain(data)
    other = (reply.address + draw.randrange(1, 256)) % 256
    return _plain(pack_reply(reply._replace(address=other)))


KINDS: Final = (
    Kind("silent", "request", "", None, 0, 0, True, None, "The request does not reach the module."),
    Kind(
        "status", "request", "N", None, 0, 255, True, None,
        "The request is not executed; it is answered with status N.",
    ),
    Kind("drop", "reply", "BYTES", SIZE, 1, SIZE, True, _drop, "BYTES of the reply get lost, all of it by default."),
    Kind("delay", "reply", "MS", 100, 0, 1e6, True, _delay, "The reply comes MS milliseconds later."),
    Kind("late_reply", "reply", "", None, 0, 0, True, None, "The reply comes when the host sends its next request."),
    Kind("duplicate", "reply", "", None, 0, 0, True, _duplicate, "The reply comes twice."),
    Kind("bad_checksum", "reply", "", None, 0, 0, False, _bad_checksum, "The last byte of the reply is another one."),
    Kind("garble", "reply", "BYTES", 1, 1, SIZE, False, _garble, "BYTES of the reply are other ones."),
    Kind(
        "split", "reply", "MS", 20, 0, 1e6, False, _split,
        "The reply comes in two parts with MS milliseconds between them.",
    ),
    Kind("stray", "reply", "BYTES", 1, 1, 64, False, _stray, "BYTES of anything come before the reply."),
    Kind(
        "wrong_address", "reply", "", None, 0, 0, False, _wrong_address,
        "The reply carries the address of another module, and the right sum.",
    ),
    Kind(
        "disconnect", "line", "", None, 0, 0, False, None,
        "The line is cut in place of a reply; the host may connect again at once.",
    ),
    Kind(
        "unplug", "line", "", None, 0, 0, False, None,
        "The line is cut in place of a reply and not there again before the time given by for=.",
    ),
)  # fmt: skip
"""Every fault that there is."""

BY_NAME: Final = {kind.name: kind for kind in KINDS}
