"""The stand-alone program of a module as others see it: run, step, stop, reset, download, registers, state.

Source: manual 6.3, 6.7.36; fidelity PROG-9, PROG-10, PROG-15 to PROG-17, PROG-19, PROG-20.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from tmcm34x.clock import digest
from tmcm34x.firmware.program.execution import Execution
from tmcm34x.firmware.program.state import ProgramError, RunState
from tmcm34x.firmware.program.wait import Wait
from tmcm34x.tmcl.commands import PROGRAM_SIZE
from tmcm34x.tmcl.datagram import Instruction
from tmcm34x.tmcl.status import Status

if TYPE_CHECKING:
    from tmcm34x.clock import Value


class StandAloneProgram(Execution):
    """The stand-alone program of one module."""

    # What others see and set

    @property
    def downloading(self) -> bool:
        """Whether commands are stored instead of executed, between 132 and 133."""
        return self.memory.downloading

    @property
    def last_status(self) -> int:
        """Status of the command that was refused last, 0 for none."""
        return 0 if self.last_error is None else self.last_error.status

    @property
    def counter(self) -> int:
        """Address of the command being executed (global parameter 130)."""
        return self.registers.counter

    @property
    def accumulator(self) -> int:
        """The accumulator."""
        return self.registers.accumulator

    @accumulator.setter
    def accumulator(self, value: int) -> None:
        self.wake()
        self.registers.accumulator = value

    @property
    def x(self) -> int:
        """The X register."""
        return self.registers.x

    @property
    def stack(self) -> tuple[int, ...]:
        """Return addresses of the open CSUBs, the latest last."""
        return tuple(self.registers.stack)

    @property
    def variables(self) -> list[int]:
        """The user variables in RAM; call `wake` before changing one."""
        return self.registers.variables

    @property
    def flags(self) -> dict[str, bool]:
        """All flags that JC looks at, by name."""
        return self.registers.flags

    def round(self) -> list[int]:
        """The addresses of one round of `cycle`, in their order; at most 1000."""
        cycle = self.cycle
        return [] if cycle is None else self._ahead.round(cycle)

    @property
    def upcoming(self) -> int:
        """Address of the command due at the next event."""
        if self._following.pursuit is not None:
            return self._following.pursuit.contents[0]
        ahead = self._ahead
        return ahead.registers.counter if ahead.until and ahead.commands else self.registers.counter

    # Control functions

    def run(self, address: int | None = None) -> Status:
        """Start the program where it stands, or at `address` with an empty stack (129)."""
        if address is not None:
            if not 0 <= address < PROGRAM_SIZE:
                return Status.INVALID_VALUE
            self.stop()
            self.registers.counter = address
            self.registers.stack.clear()
        self.controls += 1
        if self.state is not RunState.RUN:
            self._start(RunState.RUN)
        return Status.OK

    def step(self) -> Status:
        """Execute one command and stop again (130)."""
        self.controls += 1
        self._start(RunState.STEP)
        return Status.OK

    def stop(self) -> Status:
        """Stop the program where it stands (128)."""
        self.controls += 1
        self._halt()
        return Status.OK

    def reset(self) -> Status:
        """Stop, and bring counter, stack, registers and flags to their initial state (131)."""
        self.controls += 1
        self._halt()
        self.registers.reset()
        self._machine.invalidate()
        self.last_error = None
        return Status.OK

    def power_on(self, auto_start: bool) -> None:
        """Begin anew; `auto_start` (global parameter 77) starts the program from address 0."""
        self.memory.downloading = False
        self.executed = 0
        self.reset()
        if auto_start:
            self.run()

    def power_off(self) -> None:
        """Leave off at once."""
        self.controls += 1
        self._halt()

    def start_download(self, address: int) -> Status:
        """Stop and reset the program, and store all commands to come from `address` on (132)."""
        status = self.memory.may_download(address)
        if status is Status.OK:
            self.reset()
            self.memory.downloading = True
            self.memory.address = address
        return status

    def quit_download(self) -> Status:
        """Execute commands again instead of storing them (133)."""
        self.memory.downloading = False
        self._machine.invalidate()
        return Status.OK

    def erase(self) -> None:
        """Wipe the program memory: its protection against reading was given up."""
        self.reset()
        self.memory.erase()

    def calculate(self, instruction: Instruction) -> Status:
        """Execute CALC or CALCX for a host, on the program's own registers."""
        self.wake()
        self._machine.execute(self.registers, instruction)
        return Status.OK

    # State as a plain value

    def save(self) -> Value:
        """Everything that the program is, without its memory, which is the EEPROM's, and how far was looked ahead."""
        polling = self._polling.save(found=self._ahead.found(self.executed))
        return (
            self.registers.contents(), int(self.state), self.memory.downloading, self.memory.address,
            None if self.last_error is None else tuple(map(int, self.last_error)),
            self.executed, self.controls, None if self.wait is None else tuple(self.wait),
            self._due, self._started_at, self._pins_changed, self._ahead.save(self.executed), polling,
        )  # fmt: skip

    def load(self, value: Any) -> None:
        """Go back to what `save` gave; the memory must be what it was then."""
        (
            contents, state, self.memory.downloading, self.memory.address, error,
            self.executed, self.controls, waiting,
            self._due, self._started_at, self._pins_changed, ahead, polling,
        ) = value  # fmt: skip
        self._machine.invalidate()
        self.registers.restore(contents)
        self.state = RunState(state)
        self.last_error = None if error is None else ProgramError(error[0], Status(error[1]))
        self.wait = None if waiting is None else Wait(*waiting)
        self._following.pursuit = None
        self._ahead.load(ahead)
        self._polling.load(polling)

    def digest(self) -> str:
        """A fingerprint of what `save` returns."""
        return digest(self.save())
