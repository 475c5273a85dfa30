"""Run control over the stand-alone program of a module in this process.

Two ways to hold a program:

`Session` moves the time of its bench itself, and holds all of it: at a breakpoint the motors stand still in mid
air, just before the clock at which the command would have its effect.  Nothing is disturbed: a run that was
held anywhere, looked at and continued ends like one that was not (fidelity DBG-1).

`LiveSession` is for a bench whose time somebody else moves (`server`): it stops the program as a host would, and
motors, lines and clock go on.

Commands without a breakpoint run as fast as ever, unless a step is under way.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import TYPE_CHECKING, Final, NamedTuple, Protocol

from tmcm34x.clock import NEVER
from tmcm34x.debug.control import Breakpoint, Control, Stop
from tmcm34x.debug.view import View
from tmcm34x.firmware.motion import RAMP_MODE, V_ACTUAL, V_TARGET, VELOCITY, Axis
from tmcm34x.firmware.program import ProgramError
from tmcm34x.tmcl.commands import BY_MNEMONIC
from tmcm34x.tmcl.datagram import Instruction
from tmcm34x.tmcl.mnemonic import format_instruction
from tmcm34x.tmcl.status import STATUS_TEXTS

if TYPE_CHECKING:
    from tmcm34x.bench import Rig, World
    from tmcm34x.firmware.module import Module
    from tmcm34x.toolchain.assembler import Assembly
    from tmcm34x.toolchain.diagnostics import Location

_CSUB: Final = BY_MNEMONIC["CSUB"].number


class Frame(NamedTuple):
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


class Text:
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


class _Watcher:
    """What both kinds of session have in common."""

    def __init__(self, module: Module, world: World | None, listener: Listener, text: Text | None) -> None:
        self.module = module
        self.program = module.program
        self.listener = listener
        self.text = text
        self.view = View.of(module, world)
        if text is not None:
            self.view.symbols = text.assembly.symbols
        self.control = Control(self.view.read, listener.said)
        self._stop: Stop | None = None
        self.stop_on_errors = False
        """Hold after a command that the module refuses."""
        self._error: ProgramError | None = self.program.last_error

    @property
    def stop(self) -> Stop | None:
        """Why the program is held; None while it is not."""
        return self._stop

    def execute(self, instruction: Instruction) -> tuple[int, int]:
        """Have a command executed as in direct mode."""
        return self.module.execute(instruction)

    def frames(self) -> list[Frame]:
        """The open routines, the innermost first."""
        stop = self.stop
        address = stop.address if stop is not None and stop.reason == "exception" else self.program.counter
        addresses = [address, *(following - 1 for following in reversed(self.program.stack))]
        names = [self._called_at(caller) for caller in addresses[1:]]
        return [
            Frame(address, name, self.text.location(address) if self.text else None)
            for address, name in zip(addresses, [*names, "program"], strict=True)
        ]

    def _called_at(self, caller: int) -> str:
        instruction = self.module.eeprom.read_instruction(caller)
        if instruction.number != _CSUB:
            return self.text.routine(caller) if self.text else ""
        return self.text.label(instruction.value) if self.text else f"address {instruction.value}"

    def _refused(self) -> Stop | None:
        """A stop for a command that was refused since the last look."""
        error = self.program.last_error
        if error is self._error:
            return None
        self._error = error
        if error is None or not self.stop_on_errors:
            return None
        return Stop("exception", error.address, error_text(self.module, error))


def error_text(module: Module, error: ProgramError) -> str:
    """What went wrong in a program, in one line."""
    stored = module.program.read(error.address)
    if not isinstance(stored, Instruction) or stored.number == 0:
        return "the program ran past its end; is a STOP missing?"
    return f"{format_instruction(stored)}: {STATUS_TEXTS[error.status]} (status {error.status:d})"


def at_rest(module: Module) -> bool:
    """Whether each motor goes on as it does now: it stands, turns evenly, or is held by a switch."""
    if any(search.state for search in module.searches):
        return False
    return module.board.next_event() >= NEVER or all(map(_even, module.axes))


def _even(axis: Axis) -> bool:
    speed = axis.read(V_ACTUAL)
    if axis.read(RAMP_MODE) == VELOCITY:
        return speed == axis.read(V_TARGET)
    return not speed and axis.at_target


def _never() -> bool:
    return False


class Session(_Watcher):
    """A program on a bench whose time is this session's to move.

    The program is held from the start: `start`, then `resume` or a step, then `advance` as long as `running`.
    """

    def __init__(self, rig: Rig, listener: Listener, text: Text | None = None, *, module: int = 0) -> None:
        super().__init__(rig.modules[module], rig.worlds[module], listener, text)
        self.rig = rig
        self.running = False
        self.over = False
        self._passed = NEVER
        """The clock of the command before which the program was last held."""

    def start(self, address: int = 0, *, hold: bool = True) -> None:
        """Start the program, and hold it before its first command unless told otherwise."""
        self.program.run(address)
        self._error = None
        if hold:
            self.control.step(None, "entry")
        self.resume()
        if hold:
            self.advance(NEVER)

    def set_breakpoints(self, breakpoints: Iterable[Breakpoint]) -> None:
        """Hold at these instead of the present ones."""
        self.control.set_breakpoints(breakpoints)
        self._attach()

    # Going on

    def resume(self) -> None:
        """Let time go on until something holds it."""
        self._stop = None
        self.running = not self.over
        self._attach()

    def step_in(self) -> None:
        """Execute one command."""
        self._step(None)

    def step_over(self) -> None:
        """Execute one command, a CSUB with all that it calls."""
        self._step(len(self.program.stack))

    def step_out(self) -> None:
        """Go on until the innermost CSUB has returned; from the outermost level, until something else holds."""
        depth = len(self.program.stack)
        if depth:
            self._step(depth - 1)
        else:
            self.resume()

    def pause(self) -> None:
        """Hold everything here and now."""
        if self.running:
            self.control.clear_step()
            self._hold(Stop("pause", self.program.counter))

    def jump(self, address: int) -> None:
        """Have the program go on at `address`; raises `ExpressionError` in the middle of a WAIT."""
        self.view.assign("counter", str(address))

    def _step(self, depth: int | None) -> None:
        self.control.step(depth)
        self.resume()

    # Time

    def advance(self, until: int, interrupted: Callable[[], bool] = _never) -> bool:
        """Let time go on to `until`, unless something holds it before; whether it got that far or was held.

        interrupted: asked after each event whether to break off
        """
        rig = self.rig
        while self.running and not self._ends():
            when = rig.next_event()
            if when > until or when >= NEVER:
                if rig.now < until < NEVER:
                    rig.advance(until)
                break
            if self._holds_before(when):
                break
            rig.advance(when)
            self._look_back()
            if interrupted():
                return not self.running
        return True

    def _holds_before(self, when: int) -> bool:
        """Whether the next command, if it is due at `when`, is one to hold before; the bench is then just there."""
        program = self.program
        if self.control.idle or when == self._passed or program.waiting or not program.active:
            return False
        if program.next_event() != when or not self.control.concerns(program.upcoming):
            return False
        if self.rig.now < when - 1:
            self.rig.advance(when - 1)
        stop = self.control.look(program.counter, len(program.stack))
        if stop is None:
            return False
        self._passed = when
        self._hold(stop)
        return True

    def _look_back(self) -> None:
        stop = self._refused()
        if stop is not None:
            self.control.clear_step()
            self._hold(stop)

    def _ends(self) -> bool:
        """Whether nothing is going on any more; tells of it once."""
        if self.program.active:
            return False
        if not (at_rest(self.module) if self.module.powered else self.rig.next_event() >= NEVER):
            return False
        self.running = False
        self.over = True
        self.listener.ended()
        return True

    def _hold(self, stop: Stop) -> None:
        self._stop = stop
        self.running = False
        self._attach()
        self.listener.held(stop)

    def _attach(self) -> None:
        """Have the program stop for a moment where that matters; this session asks `control` by itself."""
        self.program.hook(None if self.control.idle else _let_pass, self.control.addresses)


def _let_pass(_: int) -> bool:
    return False


class LiveSession(_Watcher):
    """A program on a bench whose time somebody else moves; bring the bench to now before calling any method.

    Holding is control function 128, going on is 129: a WAIT that was interrupted begins again.
    """

    def __init__(
        self, module: Module, listener: Listener, text: Text | None = None, world: World | None = None
    ) -> None:
        super().__init__(module, world, listener, text)
        self._going = self.program.active
        self._controls = self.program.controls
        self.program.on_refusal = self._holds_after

    @property
    def stop(self) -> Stop | None:
        """Why the program is held; None while it is not, or since somebody else has started or stopped it."""
        return self._stop if self._controls == self.program.controls else None

    @property
    def running(self) -> bool:
        """Whether the program runs."""
        return self.program.active

    def set_breakpoints(self, breakpoints: Iterable[Breakpoint]) -> None:
        """Hold at these instead of the present ones."""
        self.control.set_breakpoints(breakpoints)
        self._attach()

    def resume(self) -> None:
        """Let the program go on."""
        self._stop = None
        self._going = True
        self._attach()
        self.program.run()
        self._controls = self.program.controls

    def restart(self) -> None:
        """Start the program from its beginning."""
        self.program.reset()
        self.resume()

    def step_in(self) -> None:
        """Execute one command."""
        self._step(None)

    def step_over(self) -> None:
        """Execute one command, a CSUB with all that it calls."""
        self._step(len(self.program.stack))

    def step_out(self) -> None:
        """Go on until the innermost CSUB has returned."""
        self._step(len(self.program.stack) - 1)

    def pause(self) -> None:
        """Hold the program where it is."""
        if self.program.active:
            self.program.stop()
            self._hold(Stop("pause", self.program.counter))

    def jump(self, address: int) -> None:
        """Have the program go on at `address`."""
        self.view.assign("counter", str(address))

    def look(self) -> None:
        """Tell of what nothing else tells: that the program has stopped by itself, or somebody else has stopped it."""
        if self._controls != self.program.controls:
            self._controls = self.program.controls
            self._let_go()
        stop = self._refused()
        if stop is not None:
            self.program.stop()
            self._hold(stop)
        elif self._going and not self.program.active:
            self._let_go()
            self.listener.ended()

    def _holds_after(self) -> bool:
        """Whether to hold after the command that was just refused."""
        stop = self._refused()
        if stop is not None:
            self._hold(stop)
        return stop is not None

    def _let_go(self) -> None:
        """Whatever was under way is over."""
        self._stop = None
        self._going = self.program.active
        self.control.clear_step()
        self._attach()

    def _step(self, depth: int | None) -> None:
        self.control.step(depth)
        self.resume()

    def _before(self, address: int) -> bool:
        if not self.control.concerns(address):
            return False
        stop = self.control.look(address, len(self.program.stack))
        if stop is None:
            return False
        self._hold(stop)
        return True

    def _hold(self, stop: Stop) -> None:
        self._stop = stop
        self._controls = self.program.controls
        self._going = False
        self.control.clear_step()
        self._attach()
        self.listener.held(stop)

    def _attach(self) -> None:
        self.program.hook(None if self.control.idle else self._before, self.control.addresses)
