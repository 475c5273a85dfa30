"""Run control over a module of this process whose time the server moves.

The program is stopped as a host would stop it; motors, lines and the clock go on.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING, Final

from tmcm34x.debug.breaks import Wanted
from tmcm34x.debug.control import Breakpoint, Stop
from tmcm34x.debug.expressions import ExpressionError
from tmcm34x.debug.sessions.base import Listener, Text
from tmcm34x.debug.sessions.local import LocalSession
from tmcm34x.debug.sessions.one_way import OneWay
from tmcm34x.debug.watches import Watch

if TYPE_CHECKING:
    from tmcm34x.bench import World
    from tmcm34x.firmware.module import Module

POLL_S: Final = 0.05
"""Time between two looks at the program [s]."""


class LiveSession(OneWay, LocalSession):
    """A program on a bench whose time its owner advances; bring the bench to now before calling any method.

    Holding is control function 128, going on is 129: a WAIT that was interrupted begins again.
    """

    irreversible = "the module's time is not this session's: its hosts would not go back with it"
    owns_time = False
    over = False
    exit_code = 0

    def __init__(
        self, module: Module, listener: Listener, text: Text | None = None, world: World | None = None
    ) -> None:
        super().__init__(module, world, listener, text)
        self._going = self.program.active
        self._controls = self.program.controls
        self.program.on_refusal.append(self._holds_after)

    @property
    def stop(self) -> Stop | None:
        """Why the program is held; None while it is not, or since another host has started or stopped it."""
        return self._stop if self._controls == self.program.controls else None

    @property
    def running(self) -> bool:
        """Whether the program runs."""
        return self.program.active

    def begin(self, *, hold: bool) -> None:
        """Take the program as it is; hold it if asked for."""
        if self.running and hold:
            self.pause()
        elif not self.running:
            self.listener.held(self.stop or Stop("pause", 0))

    def epilogue(self) -> str:
        """Nothing: the program goes on when the session ends."""
        return ""

    def check_ready(self) -> None:
        """Raise `ExpressionError` while the module has no power."""
        if not self.module.powered:
            raise ExpressionError("the module has no power")

    def work(self) -> float:
        """Look at the program; returns in how many seconds to look again."""
        self.look()
        return POLL_S

    def close(self) -> None:
        """End the run control; the program goes on."""
        self.set_breakpoints([])
        self.breaks.close()
        self.program.unhook(self._before)
        if self._holds_after in self.program.on_refusal:
            self.program.on_refusal.remove(self._holds_after)

    def set_breakpoints(self, breakpoints: Iterable[Breakpoint]) -> None:
        """Hold at these instead of the present ones."""
        self.control.set_breakpoints(breakpoints)
        self._attach()

    def set_watches(self, watches: Iterable[Watch]) -> None:
        """Hold when one of these values has changed before a command of the program."""
        self.watches.set(watches)
        self._attach()

    def set_breaks(self, wanted: Wanted) -> None:
        """Hold when one of these has happened before a command of the program, or at the next look."""
        self.breaks.set(wanted)
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
        """Report what causes no other event: the program has ended, or another host has stopped it."""
        if self._controls != self.program.controls:
            self._controls = self.program.controls
            self._let_go()
        stop = self.breaks.look(self.program.counter)
        if stop is not None:
            self.program.stop()
            self._hold(stop)
        elif self._going and not self.program.active:
            self._let_go()
            self.listener.ended()

    def _holds_after(self) -> bool:
        """Whether to hold after the command that was just refused."""
        stop = self.breaks.look(self.program.counter)
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
        stop = self.breaks.look(address) or self.watches.look(address)
        if stop is None and self.control.concerns(address):
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
        """Have the program ask before the commands that matter."""
        each = bool(self.watches) or self.breaks.besides_refusals
        if self.control.idle and not each:
            self.program.unhook(self._before)
        else:
            self.program.hook(self._before, None if each else self.control.addresses)
