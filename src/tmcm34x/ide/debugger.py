"""The debugger of the virtual module as pages use it: `debug.LiveSession` with breakpoints by source line."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Final, Literal

from tmcm34x.debug.control import Breakpoint, Stop
from tmcm34x.debug.expressions import ExpressionError
from tmcm34x.debug.session import LiveSession, Text
from tmcm34x.ide import wire

if TYPE_CHECKING:
    from tmcm34x.bench import World
    from tmcm34x.firmware.module import Module
    from tmcm34x.ide.target import Tell
    from tmcm34x.toolchain.assembler import Assembly

Step = Literal["continue", "pause", "step", "step_over", "step_out"]


class _Listener:
    """What the session tells, as events."""

    def __init__(self, module: Module) -> None:
        self._module = module
        self.tell: Tell = lambda event: None

    def held(self, stop: Stop) -> None:
        """The program is held."""
        self.tell(wire.Paused(stop.reason, stop.address, stop.text))
        self.tell(wire.Happened(self._module.now, "held", -1, f"{stop.reason} at {stop.address}"))

    def ended(self) -> None:
        """The program has stopped by itself: the state shows it."""

    def said(self, text: str, address: int) -> None:
        """A log point was passed."""
        self.tell(wire.Output("information", f"{address}: {text}"))
        self.tell(wire.Happened(self._module.now, "log", -1, text))


class Debugger:
    """Run control of one module; bring its bench to now before calling any method."""

    def __init__(self, module: Module, world: World) -> None:
        self._listener = _Listener(module)
        self._session = LiveSession(module, self._listener, world=world)

    def listen(self, tell: Tell) -> None:
        """Tell of what happens from now on."""
        self._listener.tell = tell

    @property
    def held(self) -> bool:
        """Whether the program is held where it may go on."""
        return self._session.stop is not None and not self._session.running

    def know(self, assembly: Assembly | None) -> None:
        """The program in the module comes from this text."""
        self._session.text = None if assembly is None else Text(assembly)
        self._session.view.symbols = {} if assembly is None else assembly.symbols

    def set_breakpoints(
        self, breakpoints: Sequence[wire.Breakpoint], *, errors: bool
    ) -> list[wire.PlacedBreakpoint]:
        """Hold at these, and where the module refuses a command if `errors`; tells where they came to lie."""
        made: list[Breakpoint] = []
        placed = [self._place(number, point, made) for number, point in enumerate(breakpoints)]
        self._session.stop_on_errors = errors
        self._session.set_breakpoints(made)
        return placed

    def _place(self, number: int, point: wire.Breakpoint, made: list[Breakpoint]) -> wire.PlacedBreakpoint:
        def nowhere(reason: str) -> wire.PlacedBreakpoint:
            return wire.PlacedBreakpoint(point.path, point.line, -1, reason)

        text = self._session.text
        if text is None:
            return nowhere("not in the module's program: download it first")
        address = text.address(point.path, point.line)
        if address is None:
            return nowhere("no instruction from here on")
        try:
            made.append(Breakpoint.make(number, address, point.condition, point.hits, point.log))
        except ExpressionError as error:
            return nowhere(str(error))
        return wire.PlacedBreakpoint(point.path, point.line, address, "")

    def act(self, action: Step) -> None:
        """Go on, hold, or take a step."""
        _STEPS[action](self._session)

    def release(self) -> None:
        """The program was stopped, reset or started by a command."""
        self._session.release()

    def look(self) -> None:
        """Notice refused commands and the program's own end; to be called now and then."""
        self._session.look()

    def frames(self) -> list[wire.Frame]:
        """The open routines, the innermost first."""
        return [
            wire.Frame(frame.address, frame.name, frame.location.file, frame.location.line)
            if frame.location
            else wire.Frame(frame.address, frame.name, "", 0)
            for frame in self._session.frames()
        ]

    def evaluate(self, expression: str) -> int:
        """The value of an expression over registers, variables, parameters, labels and constants."""
        try:
            return self._session.view.evaluate(expression)
        except ExpressionError as error:
            raise wire.RefusalError("expression", f"{error}.") from error

    def assign(self, target: str, value: str) -> int:
        """Change what `target` names; gives back what it is then."""
        try:
            return self._session.view.assign(target, value)
        except ExpressionError as error:
            raise wire.RefusalError("expression", f"{error}.") from error


_STEPS: Final = {
    "continue": LiveSession.resume, "pause": LiveSession.pause, "step": LiveSession.step_in,
    "step_over": LiveSession.step_over, "step_out": LiveSession.step_out,
}  # fmt: skip
