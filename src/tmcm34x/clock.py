"""Virtual time: an integer count of chip clocks, the loop that moves it, and the state of what lives in it.

All of the product below `server` counts time in clocks of the board's 16 MHz oscillator, counted
from power-on.  Nothing waits: a part says when something could next be noticed (`next_event`), and
the loop that runs it brings it there (`advance`).  The result does not depend on how time is sliced.

What a part remembers is a `Value`: `save` returns it, `load` takes it, into the same part or another one built from
the same description.  What can be derived from it (plans, caches) is not in it, and neither is what the part was
built with (wiring, listeners, seeds).  `pack` is the one encoding of values; equal values give equal bytes.

Source: TMCM-343 hardware manual V1.07 p. 23 for the frequency (docs/fidelity.md, chips).
"""

from __future__ import annotations

import json
from binascii import a2b_base64, b2a_base64
from hashlib import blake2b
from typing import Any, Final, Protocol, TypeAlias, cast

HZ: Final = 16_000_000
"""Clocks per second."""

NEVER: Final = 1 << 62
"""A clock that is not reached: more than nine thousand years."""

MS: Final = HZ // 1000
"""Clocks per millisecond, the firmware's tick."""


Value: TypeAlias = "bool | int | float | str | bytes | tuple[Value, ...] | None"
"""State as plain values: a tuple of tuples, down to numbers, strings and bytes."""

DIGEST_SIZE: Final = 16
"""Bytes of a digest."""


class Timed(Protocol):
    """Something that lives in virtual time."""

    def next_event(self) -> int:
        """The next clock at which another part could notice a change, or `NEVER`.

        Later than the clock last given to `advance`; asking twice gives the same answer.
        """
        ...

    def advance(self, now: int) -> None:
        """Bring the part to clock `now`, at most `next_event()`; going back is an error."""
        ...


class TimedBench(Timed, Protocol):
    """A bench, or something around one, in virtual time: between events it takes less to bring it on."""

    def pass_to(self, now: int, /) -> None:
        """Bring it to clock `now`, before its next event: time passes and nothing else happens."""
        ...


class Stateful(Protocol):
    """Something whose state can be taken out and put back.

    After `b.load(a.save())`, with `b` built from the same description as `a`, both behave alike from then on.
    """

    def save(self) -> Value:
        """All that it remembers; nothing is changed by asking."""
        ...

    def load(self, value: Any, /) -> None:
        """Become what `save` of an equal thing returned; listeners are not called."""
        ...

    def digest(self) -> str:
        """`digest` of what `save` returns: equal states have equal digests."""
        ...


class Part(Timed, Stateful, Protocol):
    """Something that lives in virtual time, and whose state can be saved."""


def run_until(part: Timed, until: int) -> None:
    """Bring `part` to clock `until`, stopping at each of its events.

    Events at `until` itself have happened when this returns.
    """
    while (when := part.next_event()) <= until:
        part.advance(when)
    part.advance(until)


def clocks(seconds: float) -> int:
    """The number of clocks in `seconds`, rounded to the nearest."""
    return round(seconds * HZ)


def seconds(clocks: int) -> float:
    """The time in seconds of a number of clocks."""
    return clocks / HZ


def pack(value: Value) -> bytes:
    """The bytes that stand for a value: JSON, with bytes as {"": base64}.

    Raises TypeError for what is no `Value`.
    """
    return _ENCODER.encode(value).encode()


def unpack(data: bytes) -> Value:
    """The value that `pack` made `data` of.  Raises ValueError for bytes that it did not make."""
    try:
        return _frozen(json.loads(data, object_hook=_bytes))
    except (TypeError, RecursionError) as error:
        raise ValueError("not a packed value") from error


def digest(value: Value) -> str:
    """A fingerprint of a value, in hexadecimal digits."""
    return blake2b(pack(value), digest_size=DIGEST_SIZE).hexdigest()


def _wrapped(value: object) -> dict[str, str]:
    if not isinstance(value, bytes):
        raise TypeError(f"{type(value).__name__} is no state")
    return {"": b2a_base64(value, newline=False).decode()}


def _bytes(wrapped: dict[str, str]) -> bytes:
    if list(wrapped) != [""]:
        raise ValueError("not a packed value")
    return a2b_base64(wrapped[""], strict_mode=True)


def _frozen(value: Any) -> Value:
    if type(value) is not list:
        return value
    items = cast("list[Any]", value)
    return tuple([_frozen(item) if type(item) is list else item for item in items])


_ENCODER: Final = json.JSONEncoder(separators=(",", ":"), check_circular=False, default=_wrapped)
