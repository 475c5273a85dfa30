"""Run control over a module of this process whose time the server moves.

The program is stopped as a host would stop it; motors, lines and the clock go on.  With a history what is held,
started and changed is recorded, and a past moment may be shown: then the session looks at that, going on moves along
what was recorded up to the present, and what would change anything is refused.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any, Final, NamedTuple, cast

from tmcm34x.debug.branches import HistoryError
from tmcm34x.debug.control import Stop
from tmcm34x.debug.course import CONTROLS, HELD, REFUSED
from tmcm34x.debug.expressions import ExpressionError
from tmcm34x.debug.reverse import Here, next_command, next_stop
from tmcm34x.debug.sessions.backward import Backward, Found
from tmcm34x.debug.sessions.base import Listener, SourceMap
from tmcm34x.debug.sessions.guest import Guest
from tmcm34x.debug.sessions.local import LocalSession
from tmcm34x.debug.sessions.search import Outcome, PlaybackSearch, UnfinishedError
from tmcm34x.debug.view import View

if TYPE_CHECKING:
    from tmcm34x.bench import World
    from tmcm34x.debug.playback import Playback
    from tmcm34x.firmware.module import FirmwareModule
    from tmcm34x.firmware.program import StandAloneProgram
    from tmcm34x.tmcl.datagram import Instruction

POLL_S: Final = 0.05
"""Time between two looks at the program [s]."""


class Scene(NamedTuple):
    """What a session looks at."""

    module: FirmwareModule
    view: View


IRREVERSIBLE: Final = "the module's time is not this session's: its hosts would not go back with it"
"""Why a program cannot be taken back where no history is kept."""
PAST: Final = "a past moment is shown: continue from here, or return to the present"
"""Why nothing can be changed."""


class LiveSession(Backward, Guest, LocalSession):
    """A program on a bench whose time its owner advances; bring the bench to now before calling any method.

    Holding is control function 128, going on is 129: a WAIT that was interrupted begins again.
    """

    _number = 0
    """Index of the module on its bench."""

    def __init__(
        self,
        module: FirmwareModule,
        listener: Listener,
        text: SourceMap | None = None,
        world: World | None = None,
        playback: Playback | None = None,
    ) -> None:
        super().__init__(module, world, listener, text)
        self._present = Scene(module, self.view)
        self._live: StandAloneProgram = self.program
        self._going = self._live.active
        self._controls = self._live.controls
        self._live.on_refusal.append(self._holds_after)
        self._playback = playback
        self._past = self._present
        self._past_stop: Stop | None = None
        """Why a past moment is shown; None where it was just chosen."""
        self.searches_apart = False
        """Methods that look for something in the past raise `UnfinishedError`, and find it when called again."""
        self._search: PlaybackSearch | None = None
        self._found: dict[tuple[Any, ...], Outcome] = {}
        if playback is not None:
            self._follow(playback)

    def _follow(self, playback: Playback) -> None:
        """Record what is done here, and show what is shown there."""
        rig, number = playback.history.past, self._number
        self._past = Scene(rig.modules[number], View.of(rig.modules[number], rig.worlds[number]))
        self._past.view.read_only = PAST
        self.view.on_write.append(self._note_assignment)
        playback.on_change.append(self._turn_to)
        playback.history.on_change.append(self._begin_anew)
        self._turn_to()

    @property
    def irreversible(self) -> str:
        """Why the program cannot be taken back; empty where it can."""
        return "" if self._playback is not None else IRREVERSIBLE

    @property
    def looking_back(self) -> bool:
        """Whether a past moment is looked at."""
        return self._playback is not None and self._playback.shown is not None

    @property
    def foreign(self) -> bool:
        """Whether the memory held another program at the past moment that is looked at."""
        return self.looking_back and self.module.eeprom.program != self._present.module.eeprom.program

    @property
    def stop(self) -> Stop | None:
        """Why the program is held; None while it is not, or since another host has started or stopped it."""
        if self.looking_back:
            return (self._past_stop or Stop("goto", 0))._replace(address=self.program.counter)
        return self._stop if self._controls == self._live.controls else None

    @property
    def running(self) -> bool:
        """Whether the program runs; a past moment stands."""
        return self._live.active and not self.looking_back

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
        self.end_search()
        self.set_breakpoints([])
        self.breaks.close()
        self._live.unhook(self._before)
        if self._holds_after in self._live.on_refusal:
            self._live.on_refusal.remove(self._holds_after)
        if self._playback is not None and self._turn_to in self._playback.on_change:
            self._playback.on_change.remove(self._turn_to)
            self._playback.history.on_change.remove(self._begin_anew)
            self._present.view.on_write.remove(self._note_assignment)

    def execute(self, instruction: Instruction) -> tuple[int, int]:
        """Execute a command in direct mode."""
        self._expect_present()
        result = super().execute(instruction)
        self._note("command", tuple(instruction))
        return result

    def resume(self) -> None:
        """Let the program go on; from a past moment, to where something held it or to the present."""
        if self.looking_back:
            self._go_forward(None)
            return
        self._stop = None
        self._going = True
        self._attach()
        self._do("run")
        self._controls = self._live.controls

    def restart(self) -> None:
        """Start the program from its beginning."""
        self._expect_present()
        self._do("reset")
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
        if self._live.active and not self.looking_back:
            self._do("stop")
            self._hold(Stop("pause", self._live.counter))

    def jump(self, address: int) -> None:
        """Have the program go on at `address`."""
        self._expect_present()
        self.view.assign("counter", str(address))

    def restart_frame(self, number: int) -> None:
        """Go back to the first command of an open routine."""
        self._expect_present()
        super().restart_frame(number)

    def look(self) -> None:
        """Report what causes no other event: the program has ended, or another host has stopped it."""
        if self.looking_back:
            return
        if self._controls != self._live.controls:
            self._controls = self._live.controls
            self._let_go()
        stop = self.breaks.look(self._live.counter)
        if stop is not None:
            self._do("stop")
            self._hold(stop)
        elif self._going and not self._live.active:
            self._let_go()
            self.listener.ended()

    # After each event: `debug.attended`

    @property
    def attends(self) -> bool:
        """Whether anything besides commands holds the program, which runs."""
        return self._live.active and (bool(self.watches) or self.breaks.besides_refusals)

    def next_look(self) -> int:
        """The next clock at which a motor comes to a position that a data breakpoint compares it with."""
        return self.watches.next_event()

    def attend(self) -> None:
        """Hold where something happened at this clock."""
        broken, changed = self.breaks.look(self._live.counter), self.watches.look(self._live.counter)
        if (stop := broken or changed) is not None:
            self._do("stop")
            self._hold(stop)

    def _holds_after(self) -> bool:
        """Whether to hold after the command that was just refused."""
        stop = self.breaks.look(self._live.counter)
        if stop is not None:
            self._note_hold(REFUSED, ())
            self._hold(stop)
        return stop is not None

    # The past

    def _expect_present(self) -> None:
        if self.looking_back:
            raise HistoryError(PAST)

    def _turn_to(self) -> None:
        """Look at the moment that is shown now."""
        self.end_search()
        looked_back = self.module is not self._present.module
        scene = self._past if self.looking_back else self._present
        scene.view.symbols = self.view.symbols
        self.module, self.view, self.program = scene.module, scene.view, scene.module.program
        self._past_stop = None
        if looked_back and not self.looking_back and not self.running:
            self.listener.held(self.stop or Stop("pause", self._live.counter))

    def _begin_anew(self) -> None:
        """The bench was brought back: whatever was under way here has not happened."""
        self.end_search()
        self._controls = self._live.controls
        self._stop, self._going = None, self._live.active
        self.control.clear_step()
        self.breaks.look_again()
        self.watches.look_again()
        self._attach()

    def _known_playback(self) -> Playback:
        if self._playback is None:
            raise HistoryError(self.irreversible)
        return self._playback

    def _here(self) -> Here:
        playback = self._known_playback()
        course = playback.history.looking
        return Here.of(playback.rig, course, playback.branch, self._number)

    def _go_back(self, clock: int, stop: Stop) -> None:
        if self._playback is not None:
            self._playback.show(clock)
            self._past_stop = stop
            self.listener.held(stop._replace(address=self.program.counter))

    def _find(self, what: tuple[Any, ...], search: Callable[[Here], Found]) -> Found:
        if not self.searches_apart:
            return super()._find(what, search)
        if what in self._found:
            return cast(Found, self._found[what]())
        self._search = PlaybackSearch(self._known_playback(), self._number, what, search, self._found)
        raise UnfinishedError(self._search)

    def end_search(self) -> None:
        """Give up what is being looked for, and forget what was found."""
        self._found.clear()
        if self._search is not None:
            self._search.cancel()
            self._search = None

    def _go_forward(self, step: tuple[int | None] | None) -> None:
        """Along what was recorded: to the end of a step (how deep it may end), or to where something held."""
        here = self._here()
        moment = (
            None if step is None else self._find(("next", *step), lambda start: next_command(start, *step))
        )
        end = here.branch.end if moment is None else moment.clock
        sought = self._sought
        found = self._find(("next stop", step), lambda start: next_stop(start, sought, end))
        if found is not None and not self._is_present(found.clock):
            self._go_back(*found)
        elif moment is not None and found is None:
            self._go_back(moment.clock, Stop("step", moment.address))
        else:
            self._go_to_end()

    def _is_present(self, clock: int) -> bool:
        """Whether the program stands there as it is held now."""
        history = self._known_playback().history
        if self._known_playback().branch is not history.branch or self._live.active:
            return False
        there = history.look_at(clock).modules[self._number].program
        return there.executed == self._live.executed

    def _go_to_end(self) -> None:
        """To the present, or to the end of a branch that was left."""
        playback = self._known_playback()
        if playback.branch is not playback.history.branch:
            self._go_back(playback.branch.end, Stop("pause", -1, "the end of this branch"))
        else:
            playback.leave()

    # What is recorded

    def _note(self, kind: str, values: tuple[Any, ...]) -> None:
        if self._playback is not None:
            self._playback.history.record(kind, self._number, values)

    def _note_hold(self, kind: str, values: tuple[int, ...]) -> None:
        if self._playback is not None:
            self._playback.history.record_hold(kind, self._number, values)

    def _note_assignment(self, target: str, value: int) -> None:
        self._note("assignment", (target, value))

    def _do(self, control: str) -> None:
        """Run, stop or reset the program."""
        CONTROLS[control](self._live)
        self._note("control", (control,))

    # Holding

    def _let_go(self) -> None:
        """Whatever was under way is over."""
        self._stop = None
        self._going = self._live.active
        self.control.clear_step()
        self._attach()

    def _step(self, depth: int | None) -> None:
        if self.looking_back:
            self._go_forward((depth,))
            return
        self.control.step(depth)
        self.resume()

    def _before(self, address: int) -> bool:
        stop = self.breaks.look(address) or self.watches.look(address)
        if stop is None and self.control.concerns(address):
            stop = self.control.look(address, len(self._live.stack))
        if stop is None:
            return False
        self._note_hold(HELD, (address,))
        self._hold(stop)
        return True

    def _hold(self, stop: Stop) -> None:
        self._stop = stop
        self._controls = self._live.controls
        self._going = False
        self.control.clear_step()
        self._attach()
        self.listener.held(stop)

    def _attach(self) -> None:
        """Have the program ask before the commands that matter."""
        each = bool(self.watches) or self.breaks.besides_refusals
        if self.control.idle and not each:
            self._live.unhook(self._before)
        else:
            self._live.hook(self._before, None if each else self.control.addresses)
