"""What the server does in several commands: zeroing, search, load profile, coordinates, store and restore.

Each is a coroutine that ends by itself with a sentence for people, or raises `Trouble`; whoever runs it may cancel
it at any time and brings the motors to rest.

Source: manual 5.4 (the TMCL-IDE's tools), 6.7.4, 6.7.7, 6.7.8, 6.7.13.
"""

from __future__ import annotations

import asyncio
import statistics
from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING, Final

from tmcm34x import clock
from tmcm34x.host import commands
from tmcm34x.host.polling import AXIS_BANK
from tmcm34x.ide import wire
from tmcm34x.tmcl.axis_parameters import BY_KEY as AXIS_BY_KEY
from tmcm34x.tmcl.datagram import Instruction
from tmcm34x.tmcl.mnemonic import format_instruction
from tmcm34x.tmcl.status import Status

if TYPE_CHECKING:
    from tmcm34x.ide.target import Target, Tell

RETRIES: Final = 2
"""How often a command is sent again when no whole reply came: all of them may be executed twice."""
LOOK_S: Final = 0.02
"""Between two looks at something that is waited for."""
SETTLE_S: Final = 0.05
SAMPLES: Final = 10
SAMPLE_S: Final = 0.02
"""Between two load values, in the module's time."""


class Trouble(Exception):  # noqa: N818
    """A sequence cannot go on; says why."""


class Executor:
    """Executes the commands of sequences on the module `target`; `tell` takes what pages should see."""

    def __init__(self, target: Target, tell: Tell) -> None:
        self._target = target
        self.tell = tell

    async def send(self, instruction: Instruction) -> int:
        """Have a command executed; the value of its reply."""
        exchange = await self._target.exchange(instruction)
        for _ in range(RETRIES):
            if exchange.status:
                break
            exchange = await self._target.exchange(instruction)
        if exchange.status != Status.OK:
            raise Trouble(f"{format_instruction(instruction)}: {exchange.meaning}")
        return exchange.value

    async def read(self, key: str, motor: int) -> int:
        """The value of an axis parameter."""
        row = AXIS_BY_KEY[key]
        for _ in range(1 + RETRIES):
            (value,) = await self._target.read([wire.Watched(AXIS_BANK, row.number, motor)])
            if value is not None:
                return value
        raise Trouble(f"{row.name} of motor {motor} cannot be read")

    async def wait(self, seconds: float) -> None:
        """Let time of the module pass, so that a slow or fast virtual module is measured alike."""
        end = self._target.now + seconds * clock.HZ
        while self._target.now < end:
            await asyncio.sleep(SETTLE_S / 10)


async def zero(executor: Executor, motor: int) -> str:
    """Stop the motor and call the place where it rests 0.

    The actual position is written first: while the motor is in velocity mode that moves nothing, and the target
    position is then where the motor is.
    """
    await executor.send(commands.stop(motor))
    while await executor.read("actual_speed", motor):
        await asyncio.sleep(LOOK_S)
    await executor.send(commands.set_axis("actual_position", motor, 0))
    await executor.send(commands.set_axis("target_position", motor, 0))
    return f"Motor {motor} calls this place 0."


async def search(executor: Executor, motor: int) -> str:
    """The reference search of one motor, to its end."""
    await executor.send(commands.start_search(motor))
    while await executor.send(commands.search_state(motor)):
        await asyncio.sleep(LOOK_S)
    return f"The reference search of motor {motor} has ended."


async def go(executor: Executor, motors: Sequence[int], coordinate: int) -> str:
    """Move motors to a stored coordinate."""
    await executor.send(commands.to_coordinate(motors, coordinate))
    for motor in motors:
        while not await executor.read("position_reached", motor):
            await asyncio.sleep(LOOK_S)
    return f"At coordinate {coordinate}."


async def turn(executor: Executor, motor: int, velocity: int) -> str:
    """Turn a motor until the next motion command."""
    await executor.send(commands.rotate(motor, velocity))
    while True:
        await asyncio.sleep(1.0)


async def profile(executor: Executor, motor: int, velocities: Iterable[int]) -> str:
    """Measure the load at each velocity; a `ProfilePoint` for each."""
    for velocity in velocities:
        await executor.send(commands.rotate(motor, velocity))
        while await executor.read("actual_speed", motor) != velocity:
            await asyncio.sleep(LOOK_S)
        await executor.wait(SETTLE_S)
        loads: list[int] = []
        for _ in range(SAMPLES):
            await executor.wait(SAMPLE_S)
            loads.append(await executor.read("load_value", motor))
        executor.tell(wire.ProfilePoint(motor, velocity, statistics.fmean(loads), statistics.pstdev(loads)))
    return f"The load profile of motor {motor} is complete."


async def keep(executor: Executor, action: wire.Keeping, items: Sequence[wire.Watched]) -> str:
    """Store parameters in the EEPROM, or bring them back from it, one by one; says how far it came."""
    word = "stored in the EEPROM" if action == "store" else "restored from the EEPROM"
    title = "Storing" if action == "store" else "Restoring"
    for done, item in enumerate(items):
        executor.tell(wire.Progress(title, done, len(items)))
        try:
            await executor.send(commands.keep(action, item.bank, item.number, item.motor))
        except Trouble as trouble:
            raise Trouble(
                f"{done} of {len(items)} values are {word}, the others are not: {trouble}"
            ) from trouble
    return f"{len(items)} value{'s are' if len(items) != 1 else ' is'} {word}."
