"""SIO, GIO, SAC; CALC and CALCX in direct mode; the user functions.

Source: manual 6.7.14 to 6.7.16, 6.7.24, 6.7.29, 6.7.33; fidelity FW-9, FW-70, FW-71, FW-93.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from tmcm34x.firmware import io
from tmcm34x.tmcl.datagram import Instruction
from tmcm34x.tmcl.numbers import COMMAND
from tmcm34x.tmcl.status import Status

if TYPE_CHECKING:
    from tmcm34x.firmware.state import ModuleState, Result

OK: Final = Status.OK


def do_sio(core: ModuleState, type_: int, bank: int, value: int) -> Result:
    """SIO: set digital outputs.  Source: manual 6.7.14."""
    return io.set_output(core.circuit, type_, bank, value, core.application.accumulator), value


def do_gio(core: ModuleState, type_: int, bank: int, _value: int) -> Result:
    """GIO: read a line.  Source: manual 6.7.15."""
    return io.get_line(core.circuit, type_, bank)


def do_sac(core: ModuleState, type_: int, size: int, value: int) -> Result:
    """SAC: exchange bytes with an external SPI device.  Source: manual 6.7.24."""
    return io.exchange(core.circuit, type_, size, value, core.application.accumulator)


def do_calc(core: ModuleState, type_: int, motor: int, value: int) -> Result:
    """CALC on the program's accumulator (fidelity FW-9).  Source: manual 6.7.16."""
    return core.application.calculate(Instruction(COMMAND.CALC, type_, motor, value)), value


def do_calcx(core: ModuleState, type_: int, motor: int, value: int) -> Result:
    """CALCX on the program's registers (fidelity FW-9).  Source: manual 6.7.29."""
    return core.application.calculate(Instruction(COMMAND.CALCX, type_, motor, value)), value


def do_user_function(n: int, core: ModuleState, type_: int, motor: int, value: int) -> Result:
    """UF0..UF7: plain firmware has none.  Source: manual 6.7.33."""
    function = core.user_functions.get(n)
    return function(core, type_, motor, value) if function else (Status.NOT_AVAILABLE, value)
