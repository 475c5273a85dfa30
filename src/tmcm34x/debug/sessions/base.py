"""What every run control over a program offers, whatever module the program is in.

A session holds a program, steps it, and says where it is.  There are three: `bench.BenchSession` moves the time of
its own bench; `live.LiveSession` controls a module of this process whose time the server moves;
`remote.RemoteSession` controls a module at the other end of a line.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING, Final, NamedTuple, Protocol

from tmcm34x.debug.control import Breakpoint, Stop

if TYPE_CHECKING:
    from tmcm34x.debug.breaks import Wanted
    from tmcm34x.debug.view import View
    from tmcm34x.debug.watches import WatchedValue
    from tmcm34x.debug.writes import Write
    from tmcm34x.tmcl.datagram import Instruction
    from tmcm34x.toolchain.assembler import Assembly
    from tmcm34x.toolchain.diagnostics import Location

NOTHING_TO_DO: Final = math.inf
"""What `Session.work` returns when only a request can change anything."""


class StackFrame(NamedTuple):
    """One open routine, the innermost first: where it is, and what it is called."""

    address: int
    name: str
    location: Location | None


class Listener(Protocol):
    """Who wants to know what becomes of a program."""

    def held(self, stop: Stop) -> None:
        """The program is held."""
        ...

    def ended(self) -> None:
        """The program has stopped, and nothing it has begun is still going on."""
        ...

    def said(self, text: str, address: int) -> None:
        """A log point was passed."""
        ...


class Session(Protocol):
    """Run control over one program.

    Methods of a session over a line may raise `HostError`.
    """

    text: SourceMap | None
    view: View

    @property
    def model(self) -> int:
        """Type of the module: 341, 342 or 343."""
        ...

    @property
    def steps_for_breakpoints(self) -> str:
        """Why the program runs in single steps while there are breakpoints; empty where it does not."""
        ...

    @property
    def foreign(self) -> bool:
        """Whether a past moment is looked at at which the memory held another program than the text's."""
        ...

    @property
    def owns_time(self) -> bool:
        """Whether the session moves virtual time itself, so that holding the program holds everything."""
        ...

    @property
    def running(self) -> bool:
        """Whether the program runs."""
        ...

    @property
    def over(self) -> bool:
        """Whether the program has ended and nothing it began is still going on."""
        ...

    @property
    def stop(self) -> Stop | None:
        """Why the program is held; None while it runs."""
        ...

    @property
    def exit_code(self) -> int:
        """3 when a command of the program was refused, as `tmcm34x run` has it; otherwise 0."""
        ...

    def epilogue(self) -> str:
        """How the program ended, in one line; empty where that is not known."""
        ...

    def check_ready(self) -> None:
        """Raise `ExpressionError` where the program cannot go on, with the reason."""
        ...

    def memory(self) -> Sequence[Instruction]:
        """The program memory, as far as it is known."""
        ...

    def instruction(self, address: int) -> Instruction | None:
        """The command at `address`; None where there is none or it is not known."""
        ...

    def execute(self, instruction: Instruction) -> tuple[int, int]:
        """Execute a command in direct mode; status and value of its reply."""
        ...

    def frames(self) -> list[StackFrame]:
        """The open routines, the innermost first."""
        ...

    def set_breakpoints(self, breakpoints: Iterable[Breakpoint]) -> None:
        """Hold at these instead of the present ones."""
        ...

    def hits(self) -> dict[int, int]:
        """How often each breakpoint was met with its condition true, by its number."""
        ...

    @property
    def irreversible(self) -> str:
        """Why the program cannot be taken back; empty where it can."""
        ...

    def step_back(self, *, over: bool) -> None:
        """Go back to just before the last command; `over`: a CSUB with all that it called counts as one."""
        ...

    def reverse_continue(self) -> None:
        """Go back to where a breakpoint or data breakpoint would have held last, or to the beginning."""
        ...

    def who_wrote(self, text: str) -> Write | None:
        """What wrote a value last; raises `ExpressionError` where `text` names nothing."""
        ...

    @property
    def unwatchable(self) -> str:
        """Why there are no data breakpoints; empty where there are."""
        ...

    def set_watches(self, watches: Iterable[WatchedValue]) -> None:
        """Hold when one of these values changes, instead of the present ones."""
        ...

    def set_breaks(self, wanted: Wanted) -> None:
        """Hold when one of these happens, instead of the present ones."""
        ...

    def loaded(self, program: Sequence[Instruction]) -> None:
        """The program memory holds `program` now."""
        ...

    def controlled(self) -> None:
        """A command of another host may have stopped, reset or started the program."""
        ...

    def begin(self, *, hold: bool) -> None:
        """Everything is set up: start the program, or take it as it is; `hold` it at once if asked for."""
        ...

    def resume(self) -> None:
        """Let the program go on."""
        ...

    def restart(self) -> None:
        """Start the program from its beginning."""
        ...

    def pause(self) -> None:
        """Hold the program where it is."""
        ...

    def step_in(self) -> None:
        """Execute one command."""
        ...

    def step_over(self) -> None:
        """Execute one command, a CSUB with all that it calls."""
        ...

    def step_out(self) -> None:
        """Go on until the innermost CSUB has returned."""
        ...

    def jump(self, address: int) -> None:
        """Have the program go on at `address`; raises `ExpressionError` where it cannot."""
        ...

    def restart_frame(self, number: int) -> None:
        """Go back to the first command of an open routine, 0 the innermost; raises `ExpressionError`."""
        ...

    def work(self) -> float:
        """Do a piece of work; returns in how many seconds to call again."""
        ...

    def close(self) -> None:
        """End the run control: nothing of the session is left in the program."""
        ...


class SourceMap:
    """What is known about the program's source: addresses to lines and labels, both ways."""

    def __init__(self, assembly: Assembly) -> None:
        self.assembly = assembly
        self._map = assembly.source_map
        self._labels = {address: name for name, address in reversed(assembly.labels.items())}

    def location(self, address: int) -> Location | None:
        """Where the command at `address` stands."""
        return self._map[address] if 0 <= address < len(self._map) else None

    def address(self, file: str, line: int) -> int | None:
        """Of the first command in `line` of `file` or below it."""
        below = [(place.line, address) for address, place in enumerate(self._map) if place.file == file]
        return min((item for item in below if item[0] >= line), default=(0, None))[1]

    def label(self, address: int) -> str:
        """The label at `address`, or its number."""
        return self._labels.get(address, f"address {address}")

    def routine(self, address: int) -> str:
        """The label at or next above `address`; empty where there is none."""
        above = [labelled for labelled in self._labels if labelled <= address]
        return self._labels[max(above)] if above else ""
