"""Motors that somebody turns by holding a button: none goes on turning when the button's page is gone.

A page says again and again that the button is held.  A page that is closed, crashes, sleeps or loses its line says
nothing any more, and the motor is stopped.
"""

from __future__ import annotations

import asyncio
from typing import TYPE_CHECKING, Final, NamedTuple

from tmcm34x.ide import wire
from tmcm34x.tmcl.commands import BY_MNEMONIC, MOTORS
from tmcm34x.tmcl.datagram import Instruction

if TYPE_CHECKING:
    from tmcm34x.ide.target import Target

PATIENCE_S: Final = 1.0
"""How long a motor turns without a word from the page that turns it."""
_TOP_SPEED: Final = 2047
_ROR: Final = BY_MNEMONIC["ROR"].number
_ROL: Final = BY_MNEMONIC["ROL"].number
_MST: Final = BY_MNEMONIC["MST"].number


class _Hold(NamedTuple):
    owner: object
    velocity: int
    end: asyncio.TimerHandle


class Jogging:
    """Who holds which motor of `target`."""

    def __init__(self, target: Target) -> None:
        self._target = target
        self._holds: dict[int, _Hold] = {}
        self._stops: set[asyncio.Task[wire.Exchange]] = set()

    async def hold(self, owner: object, motor: int, velocity: int) -> None:
        """The button is held, or with velocity 0 let go; negative turns left."""
        if not 0 <= motor < MOTORS or abs(velocity) > _TOP_SPEED:
            raise wire.RefusalError("range", f"Motors are 0..{MOTORS - 1}, velocities 0..{_TOP_SPEED}.")
        before = self._holds.pop(motor, None)
        if before is not None:
            before.end.cancel()
        if not velocity:
            if before is not None:
                await self._target.exchange(Instruction(_MST, 0, motor))
            return
        end = asyncio.get_running_loop().call_later(PATIENCE_S, self._let_go, motor)
        self._holds[motor] = _Hold(owner, velocity, end)
        if before is None or before.velocity != velocity:
            rotate = _ROR if velocity > 0 else _ROL
            await self._target.exchange(Instruction(rotate, 0, motor, abs(velocity)))

    def leave(self, owner: object) -> None:
        """A page is gone: stop what it turned."""
        for motor in [motor for motor, hold in self._holds.items() if hold.owner is owner]:
            self._let_go(motor)

    def _let_go(self, motor: int) -> None:
        self._holds.pop(motor).end.cancel()
        stop = asyncio.ensure_future(self._target.exchange(Instruction(_MST, 0, motor)))
        self._stops.add(stop)
        stop.add_done_callback(self._stops.discard)

    async def close(self) -> None:
        """Stop all, and wait until they have been told."""
        for motor in tuple(self._holds):
            self._let_go(motor)
        await asyncio.gather(*self._stops, return_exceptions=True)
