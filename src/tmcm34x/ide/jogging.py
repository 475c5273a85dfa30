"""Motors that somebody turns by holding a button: none goes on turning when the button's page is gone.

A page says again and again that the button is held.  A page that is closed, crashes, sleeps or loses its line says
nothing any more, and the motor is stopped: with one MST after the other until the module has answered.
"""

from __future__ import annotations

import asyncio
from typing import TYPE_CHECKING, Final, NamedTuple

from tmcm34x.ide import wire
from tmcm34x.tmcl.commands import BY_MNEMONIC, MOTORS
from tmcm34x.tmcl.datagram import Instruction
from tmcm34x.tmcl.status import Status

if TYPE_CHECKING:
    from tmcm34x.ide.target import Target, Tell

PATIENCE_S: Final = 1.0
"""How long a motor turns without a word from the page that turns it."""
RETRY_S: Final = 0.25
_TOP_SPEED: Final = 2047
_ROR: Final = BY_MNEMONIC["ROR"].number
_ROL: Final = BY_MNEMONIC["ROL"].number
_MST: Final = BY_MNEMONIC["MST"].number


class _Hold(NamedTuple):
    owner: object
    velocity: int
    end: asyncio.TimerHandle


class Jogging:
    """Who holds which motor of `target`; `tell` takes what people should know."""

    def __init__(self, target: Target, tell: Tell) -> None:
        self._target = target
        self._tell = tell
        self._holds: dict[int, _Hold] = {}
        self._stops: dict[int, asyncio.Task[None]] = {}

    async def hold(self, owner: object, motor: int, velocity: int) -> None:
        """The button is held, or with velocity 0 let go; negative turns left.  Raises `wire.RefusalError`."""
        if not 0 <= motor < MOTORS or abs(velocity) > _TOP_SPEED:
            raise wire.RefusalError("range", f"Motors are 0..{MOTORS - 1}, velocities 0..{_TOP_SPEED}.")
        before = self._holds.get(motor)
        if not velocity:
            if before is not None:
                self._let_go(motor)
            return
        if before is not None:
            before.end.cancel()
        elif motor in self._stops:
            self._stops.pop(motor).cancel()
        end = asyncio.get_running_loop().call_later(PATIENCE_S, self._let_go, motor)
        self._holds[motor] = _Hold(owner, velocity, end)
        if before is None or before.velocity != velocity:
            rotate = Instruction(_ROR if velocity > 0 else _ROL, 0, motor, abs(velocity))
            exchange = await self._target.exchange(rotate)
            if exchange.status != Status.OK:
                raise wire.RefusalError("module", f"{exchange.text}: {exchange.meaning}.")

    def leave(self, owner: object) -> None:
        """A page is gone: stop what it turned."""
        for motor in [motor for motor, hold in self._holds.items() if hold.owner is owner]:
            self._let_go(motor)

    def _let_go(self, motor: int) -> None:
        self._holds.pop(motor).end.cancel()
        self._stops[motor] = asyncio.ensure_future(self._stop(motor))

    async def _stop(self, motor: int) -> None:
        told = False
        while not (exchange := await self._target.exchange(Instruction(_MST, 0, motor))).status:
            if not told:
                text = f"Motor {motor} is let go but not stopped ({exchange.meaning}): the IDE tries on."
                self._tell(wire.Output("error", text))
            told = True
            await asyncio.sleep(RETRY_S)
        if told:
            self._tell(wire.Output("information", f"Motor {motor} is stopped now."))
        self._stops.pop(motor, None)

    def forget(self) -> None:
        """The module has lost its power: nothing turns any more."""
        for task in self._stops.values():
            task.cancel()
        self._stops.clear()

    async def close(self, patience_s: float = PATIENCE_S) -> None:
        """Stop all, and wait a little until the module has answered."""
        for motor in tuple(self._holds):
            self._let_go(motor)
        if self._stops:
            await asyncio.wait(self._stops.values(), timeout=patience_s)
