"""What run control over a module of this process has in common."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING, Final

from tmcm34x.debug.breaks import Breaks, Wanted
from tmcm34x.debug.control import Breakpoint, Stop, StopControl
from tmcm34x.debug.expressions import ExpressionError
from tmcm34x.debug.sessions.base import Listener, SourceMap, StackFrame
from tmcm34x.debug.view import View
from tmcm34x.debug.watches import WatchedValue, Watches
from tmcm34x.tmcl.commands import BY_MNEMONIC, PROGRAM_SIZE
from tmcm34x.tmcl.datagram import Instruction

if TYPE_CHECKING:
    from tmcm34x.bench import World
    from tmcm34x.firmware.module import FirmwareModule

_CSUB: Final = BY_MNEMONIC["CSUB"].number


class LocalSession:
    """Run control over the program of `module`; `world` is what the module is connected to."""

    steps_for_breakpoints = ""
    unwatchable = ""

    @property
    def foreign(self) -> bool:
        """Whether a past moment is looked at at which the memory held another program than the text's."""
        return False

    def __init__(
        self, module: FirmwareModule, world: World | None, listener: Listener, text: SourceMap | None
    ) -> None:
        self.module = module
        self.program = module.program
        self.listener = listener
        self.text = text
        self.view = View.of(module, world)
        if text is not None:
            self.view.symbols = text.assembly.symbols
        self.control = StopControl(self.view.read, listener.said)
        self.watches = Watches(self.view)
        self.breaks = Breaks(module, world, self.view.read)
        self._stop: Stop | None = None

    @property
    def model(self) -> int:
        """Type of the module: 341, 342 or 343."""
        return self.module.board.model.number

    @property
    def stop(self) -> Stop | None:
        """Why the program is held; None while it is not."""
        return self._stop

    def memory(self) -> Sequence[Instruction]:
        """The program memory."""
        return tuple(map(self.module.eeprom.read_instruction, range(PROGRAM_SIZE)))

    def instruction(self, address: int) -> Instruction | None:
        """The command at `address`; None outside the program memory."""
        return self.module.eeprom.read_instruction(address) if 0 <= address < PROGRAM_SIZE else None

    def set_breakpoints(self, breakpoints: Iterable[Breakpoint]) -> None:
        """Hold at these instead of the present ones."""
        self.control.set_breakpoints(breakpoints)
        self._attach()

    def set_watches(self, watches: Iterable[WatchedValue]) -> None:
        """Hold when one of these values has changed, instead of the present ones."""
        self.watches.set(watches)
        self._attach()

    def set_breaks(self, wanted: Wanted) -> None:
        """Hold when one of these has happened, instead of the present ones."""
        self.breaks.set(wanted)
        self._attach()

    def _attach(self) -> None:
        """Have the program ask before the commands that matter."""
        raise NotImplementedError

    def hits(self) -> dict[int, int]:
        """How often each breakpoint was met, by its number."""
        return self.control.hits()

    def loaded(self, program: Sequence[Instruction]) -> None:
        """The program memory holds `program` now; it is read from the module whenever it is needed."""
        self.control.forget_hits()

    def controlled(self) -> None:
        """A command of another host may have controlled the program: the module's state shows it."""

    def execute(self, instruction: Instruction) -> tuple[int, int]:
        """Have a command executed as in direct mode."""
        return self.module.execute(instruction)

    def frames(self) -> list[StackFrame]:
        """The open routines, the innermost first."""
        stop, text = self.stop, self._fitting_text
        address = stop.address if stop is not None and stop.reason == "exception" else self.program.counter
        addresses = [address, *(following - 1 for following in reversed(self.program.stack))]
        names = [self._called_at(caller) for caller in addresses[1:]]
        return [
            StackFrame(address, name, text.location(address) if text else None)
            for address, name in zip(addresses, [*names, "program"], strict=True)
        ]

    @property
    def _fitting_text(self) -> SourceMap | None:
        return None if self.foreign else self.text

    def restart_frame(self, number: int) -> None:
        """Go back to the first command of an open routine, 0 the innermost; motors and variables stay as they are.

        Raises `ExpressionError` in the middle of a WAIT, and where there is no such routine.
        """
        stack = self.program.stack
        if not 0 <= number <= len(stack):
            raise ExpressionError(f"no open routine {number}: there are {len(stack) + 1}")
        kept = len(stack) - number
        entry = 0 if not kept else self._entry(stack[kept - 1] - 1)
        self.view.assign("counter", str(entry))
        self.view.assign("depth", str(kept))

    def _entry(self, caller: int) -> int:
        instruction = self.module.eeprom.read_instruction(caller)
        if instruction.number != _CSUB:
            raise ExpressionError(f"the routine's caller at address {caller} is no CSUB any more")
        return instruction.value

    def _called_at(self, caller: int) -> str:
        instruction = self.module.eeprom.read_instruction(caller)
        text = self._fitting_text
        if instruction.number != _CSUB:
            return text.routine(caller) if text else ""
        return text.label(instruction.value) if text else f"address {instruction.value}"
