"""The stand-alone program: its control, its commands, and the machine that runs register commands.

`program`    what others see: registers, control functions, saving
`execution`  how time changes it; `state` and `module_commands` are its vocabulary
`wait`       what a WAIT waits for
`memory`     download, reading back, protection
`registers`  accumulator, X, flags, stack, user variables
`machine`    runs register commands; `templates` says what each does, `fuse` makes one function of a loop
`ahead`      register commands run ahead on a copy
`polling`    loops that ask for what cannot change yet
"""

from tmcm34x.firmware.program.counts import AddressCounts
from tmcm34x.firmware.program.program import StandAloneProgram
from tmcm34x.firmware.program.state import ProgramError, RunState

__all__ = ["AddressCounts", "ProgramError", "RunState", "StandAloneProgram"]
