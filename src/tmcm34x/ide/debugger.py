"""Breakpoints and steps on a virtual module.

The module's own control functions know run, stop, step and reset; this adds a look at each instruction before it
is executed.  Nothing looks while there is no breakpoint and no step under way.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Literal

if TYPE_CHECKING:
    from tmcm34x.firmware.module import Module

Reason = Literal["breakpoint", "step", "pause", "entry"]


class Debugger:
    """Run control of one module; `tell` hears why and where the program was held."""

    def __init__(self, module: Module, tell: Callable[[Reason, int], None]) -> None:
        self._module = module
        self._program = module.program
        self._tell = tell
        self._breakpoints: frozenset[int] = frozenset()
        self._depth: int | None = None
        """A step goes on until no more CSUBs than this are open."""
        self.held = False

    def set_breakpoints(self, breakpoints: Mapping[int, object]) -> None:
        """Hold the program before the instructions at these addresses."""
        self._breakpoints = frozenset(breakpoints)
        self._attach()

    def release(self) -> None:
        """The program goes on, or is stopped for good: it is no longer held."""
        self.held = False
        self._depth = None
        self._attach()

    def pause(self) -> None:
        """Hold the program where it is."""
        if self._program.active:
            self._program.stop()
            self._hold("pause")

    def step(self) -> None:
        """Execute one instruction."""
        self.release()
        self._program.step()
        self.held = True

    def step_over(self) -> None:
        """Execute one instruction, a CSUB with all that it calls."""
        self._go_on(len(self._program.stack))

    def step_out(self) -> None:
        """Go on until the open CSUB has returned."""
        self._go_on(len(self._program.stack) - 1)

    def _go_on(self, depth: int) -> None:
        self.held = False
        self._depth = depth
        self._attach()
        self._program.run()

    def _attach(self) -> None:
        wanted = bool(self._breakpoints) or self._depth is not None
        self._program.before_instruction = self._look if wanted else None

    def _look(self, address: int) -> bool:
        if self._depth is not None and len(self._program.stack) <= self._depth:
            self._hold("step")
            return True
        if address in self._breakpoints:
            self._hold("breakpoint")
            return True
        return False

    def _hold(self, reason: Reason) -> None:
        self.held = True
        self._depth = None
        self._attach()
        self._tell(reason, self._program.counter)
