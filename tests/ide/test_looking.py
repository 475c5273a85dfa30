"""Windows that show everything leave a run as it is without them."""

import asyncio
import contextlib

import pytest

from ide.ide_driver import running, virtual
from tmcm34x.clock import HZ, MS, run_until
from tmcm34x.ide import wire
from tmcm34x.tmcl.axis_parameters import AXIS_PARAMETERS
from tmcm34x.tmcl.commands import COORDINATES, MOTORS
from tmcm34x.tmcl.global_parameters import GLOBAL_PARAMETERS
from tmcm34x.toolchain.assembler import assemble

PROGRAM = """
        ROR   0, 400
        MVP   ABS, 1, 20000
Loop:   GAP   206, 0
        AGP   1, 2
        GGP   133, 0
        AGP   2, 2
        GAP   208, 0
        AGP   3, 2
        GGP   0, 0
        AGP   4, 2
        WAIT  TICKS, 0, 1
        JA    Loop
"""
EVERYTHING = [
    *(wire.Watched(-1, row.number, motor) for row in AXIS_PARAMETERS for motor in range(MOTORS)),
    *(wire.Watched(row.bank, row.number, 0) for row in GLOBAL_PARAMETERS),
    *(wire.Watched(-2, number, motor) for number in range(COORDINATES) for motor in range(MOTORS)),
]
LOOKS = (
    wire.ReadMany(EVERYTHING), wire.ReadRegisters(), wire.ReadWorld(), wire.ReadEeprom(), wire.Watch(EVERYTHING[:8]),
    wire.FollowLog(on=True, polls=True),
)  # fmt: skip
STEPS = 20
START = 100 * HZ
"""Of the run: the server has kept the pace of the wall clock until it was paused."""


def outcome(folder, windows: int) -> str:
    """A fingerprint of the module after a run that so many windows look at."""

    async def run() -> str:
        target, telegrams = virtual()
        async with running(folder, (target, telegrams)) as ide, contextlib.AsyncExitStack() as stack:
            server = ide.virtual.server
            server.change_pace(paused=True)
            assert server.rig.now < START
            run_until(server.rig, START)
            server.pace.draw(START, paused=True)
            pages = [await stack.enter_async_context(ide.page()) for _ in range(windows)]
            for _ in range(windows):
                await stack.enter_async_context(ide.debugger())
            module = ide.virtual.module
            module.eeprom.write_program(assemble(PROGRAM).program)
            module.program.run(0)
            for _ in range(STEPS):
                for page in pages:
                    for look in LOOKS:
                        await page.call(look)
                ide.virtual.step_time(wire.StepTime(7.0))
            assert (module.now, module.program.active) == (START + STEPS * 7 * MS, True)
            assert module.program.registers.variables[2]
            return module.digest()

    return asyncio.run(run())


@pytest.mark.parametrize("windows", [1, 2])
def test_windows_on_every_panel_leave_a_run_byte_for_byte_as_it_is_without_them(tmp_path, windows):
    assert outcome(tmp_path, windows) == outcome(tmp_path, 0)
