"""The IDE's module when it is virtual: a bench in this process, paced by `server`.

Commands go through a line like any other host's, so what the page shows of them is what a host would see.  State
is read beside the line, which costs the module nothing.
"""

from __future__ import annotations

import asyncio
import math
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Final

from tmcm34x import clock
from tmcm34x.debug.attended import Attended
from tmcm34x.debug.sessions.base import Listener
from tmcm34x.debug.sessions.live import LiveSession
from tmcm34x.host.steps import ASCII_MODE, FACTORY_RESET
from tmcm34x.ide import wire
from tmcm34x.ide.curves import changes, curves, notable
from tmcm34x.ide.desk import Desk
from tmcm34x.ide.exchange import answered, unanswered
from tmcm34x.ide.hands import Hands
from tmcm34x.ide.past import NOT_NOW, Past
from tmcm34x.ide.sampling import Sampled, Samples
from tmcm34x.ide.seen import Seen
from tmcm34x.ide.state import ALL_UNKNOWN, NOW, Groups, bits, empty, put
from tmcm34x.server.control import MOVE_TIME
from tmcm34x.server.pace import MOST_SPEED
from tmcm34x.tmcl.commands import MOTORS
from tmcm34x.tmcl.datagram import SIZE, Instruction, pack_request
from tmcm34x.tmcl.status import Status

if TYPE_CHECKING:
    from tmcm34x.bench import Rig
    from tmcm34x.bench.action import Action
    from tmcm34x.firmware.module import FirmwareModule
    from tmcm34x.ide.target import T, Tell
    from tmcm34x.server import Server

TIMEOUT_S: Final = 1.0
"""Longest wait for an answer, on the wall clock."""
LONGEST_STEP_MS: Final = 10_000
LOOKED_AT_S: Final = 3.0
"""A page that asked for state less than this ago is looking."""

_EVENT: Final = bytes((Status.POSITION_REACHED, 138))


class Virtual:
    """A module of a bench, `rig.modules[0]`, under `server`'s pacing."""

    source: wire.Source = "virtual"
    known = True
    line = 0

    def __init__(self, server: Server, place: str, memory_file: str) -> None:
        self.server = server
        self.rig: Rig = server.rig
        self.module = self.rig.modules[0]
        self.world = self.rig.worlds[0]
        self.model = self.module.board.model
        self.place = place
        self.ability = wire.Ability(
            bench=True, debug=True, peek=True, language_server=True, history=True, irreversible=""
        )
        self.hands = Hands(self.rig, place)
        self._session: LiveSession | None = None
        self.plugged = True
        self._memory_file = memory_file
        self._tell: Tell = lambda event: None
        self.on_upset: Callable[[], None] = lambda: None
        """Called when the power was switched, or the bench brought to another state: nothing goes on as it did."""
        self._desk = Desk(self._take)
        self._urgent = Desk(lambda data: None)
        self._lock = asyncio.Lock()
        self.samples = Samples()
        self._watches: list[wire.Watched] = []
        self._looked_s = -math.inf
        self.past = Past(server, self._turned)
        self._present, self._past = Seen(self.rig), Seen(self.past.history.past)
        self._sampled = Sampled(self.past.history, self._sample, self._looking, self._paced)
        self._attended = Attended(self._sampled)
        server.part = self._attended
        self.past.history.on_restore.append(self._restored)
        self.rig.on_action.append(self._acted)
        self._received = bytearray()
        self._answer: asyncio.Future[bytes] | None = None
        self._seen: tuple[int, float] | None = None
        self._speed = 0.0
        self._notable: tuple[int, ...] = ()
        self._looking_back = False
        self._bench_told: wire.World | None = None

    async def open(self, tell: Tell) -> None:
        """Plug in the line; time begins to run."""
        self._tell = tell
        await self.server.open(self._desk)
        await self.server.open(self._urgent)

    async def close(self) -> None:
        """Unplug and save."""
        await self.server.close()

    @property
    def link(self) -> wire.Link:
        """The line of a virtual module is at its bench."""
        return wire.Link(True, "", self.place, False)

    # The line

    async def exchange(self, instruction: Instruction) -> wire.Exchange:
        """Send a command and wait for its answer."""
        if self.past.shown:
            raise wire.RefusalError("past", NOT_NOW)
        async with self._lock:
            sent = pack_request(self.module.address, instruction)
            if not self.plugged:
                return unanswered(instruction, sent, "no answer: the line is unplugged")
            if not self.module.powered:
                return unanswered(instruction, sent, "no answer: the module has no power")
            self._received.clear()
            self._answer = asyncio.get_running_loop().create_future()
            self._desk.write(sent)
            try:
                # Not `wait_for`, which may lose a cancellation that comes together with the reply.
                async with asyncio.timeout(self._patience(instruction)):
                    received = await self._answer
                await asyncio.sleep(0)  # a reply that came at once must not keep others from their turn
            except TimeoutError:
                return unanswered(instruction, sent, self._silence(instruction))
            finally:
                self._answer = None
            if instruction.number == ASCII_MODE:
                self._reconnect()
            return answered(instruction, sent, received)

    async def ask(self, instruction: Instruction) -> wire.Exchange:
        """The same: nothing is lost on this line."""
        return await self.exchange(instruction)

    def urgent(self, instructions: Sequence[Instruction]) -> None:
        """Send commands on a line of their own, without waiting for answers; the present is shown again."""
        self.past.leave()
        if self.plugged:
            for instruction in instructions:
                self._urgent.write(pack_request(self.module.address, instruction))

    async def send_ascii(self, line: str) -> str:
        """The IDE leaves the ASCII interface of a virtual module at once."""
        raise wire.RefusalError("binary", "The IDE's line of a virtual module stays in binary mode.")

    def _patience(self, instruction: Instruction) -> float:
        if instruction.number == FACTORY_RESET or self.module.silent:
            return 0.05
        return TIMEOUT_S

    def _silence(self, instruction: Instruction) -> str:
        if instruction.number == FACTORY_RESET:
            return "done: this command is never answered"
        if self.module.silent:
            return "no answer: parameter 255 switches replies off"
        if self.server.pace.paused:
            return "no answer yet: time is held"
        return "no answer in time"

    def _reconnect(self) -> None:
        """Leave the ASCII interface: the IDE speaks binary."""
        self._desk.plug_in()
        self._tell(
            wire.Output("information", "The ASCII interface was entered; the IDE has opened a new line.")
        )

    def _take(self, data: bytes) -> None:
        """Bytes from the module; second replies of command 138 come by themselves."""
        if not self.plugged:
            return
        self._received += data
        while len(self._received) >= SIZE:
            telegram = bytes(self._received[:SIZE])
            del self._received[:SIZE]
            if telegram[2:4] == _EVENT:
                self._tell(wire.Happened(self.rig.now, "target", -1, "targets reached"))
            elif self._answer is not None and not self._answer.done():
                self._answer.set_result(telegram)

    # The debugger

    @property
    def now(self) -> float:
        """The bench's clock."""
        return self.rig.now

    def session(self, listener: Listener) -> LiveSession:
        """Run control of the module's program, the former one ended."""
        if self._session is not None:
            self._session.close()
        self._session = LiveSession(self.module, listener, world=self.world, playback=self.past.playback)
        self._session.searches_apart = True
        self._attended.session = self._session
        return self._session

    async def debug(self, work: Callable[[], T], *, polling: bool = False) -> T:
        """Do something with the session, at the time that it is now."""
        self.server.catch_up()
        try:
            return work()
        finally:
            self.server.settle()

    @property
    def _held(self) -> bool:
        """Whether the program is held where it may go on; a past moment stands."""
        if self.past.shown:
            return True
        session = self._session
        return session is not None and session.stop is not None and not session.running

    # Reading beside the line

    def hush(self, on: bool) -> None:
        """Nothing is sent without being asked for."""

    async def read(self, items: Sequence[wire.Watched]) -> list[int | None]:
        """Values of parameters and coordinates, as a command would read them."""
        self.server.catch_up()
        values = self.watched(items)
        self.server.settle()
        return values

    def watch(self, items: Sequence[wire.Watched]) -> None:
        """Sample these too."""
        self._watches = list(dict.fromkeys(items))

    def _paced(self) -> bool:
        """Whether the wall clock holds virtual time back."""
        return self.server.pace.speed > 0

    def _looking(self) -> bool:
        """Whether a page has asked for state a short while ago."""
        return self.server.pace.monotonic() - self._looked_s < LOOKED_AT_S

    def _sample(self) -> None:
        """A row of samples, as of now."""
        values = curves(self.module)
        self.samples.add(self.rig.now, values, {item: self._present.read(item) for item in self._watches})
        self._note()

    def watched(self, items: Sequence[wire.Watched]) -> list[int | None]:
        """Present values of watched parameters."""
        return [self._shown.read(item) for item in items]

    # State

    @property
    def _shown(self) -> Seen:
        """The module as it is shown: that of the present, or a past one."""
        if not self.past.shown:
            return self._present
        self.past.playback.seek()
        return self._past

    def _turned(self) -> None:
        """Another moment is shown, or the bench went on from a past one."""
        self._seen, self._speed = None, self.server.pace.speed
        self._sampled.begin_anew()
        if not self.past.shown:
            self._notable = notable(self.module)
        self._tell_of_bench()
        if self._looking_back != self.past.shown:
            self._looking_back = self.past.shown
            self._tell(self.past.shape)

    def _restored(self) -> None:
        """The bench was brought to a state that is not of its past."""
        self._turned()
        self.on_upset()

    def _acted(self, action: Action, _: int) -> None:
        """Something was done to the bench, by a page or through the control socket."""
        self._tell_of_bench()
        if action.name == "power" and action.module == 0:
            self.on_upset()

    def not_now(self, request: str) -> str:
        """Why a request of the control socket cannot be done now; empty where it can."""
        return NOT_NOW.rstrip(".") if self.past.shown and request in MOVE_TIME else ""

    def bench(self) -> wire.World:
        """What hangs on the module as it is shown."""
        return self.hands.shape(self._shown.world)

    def _tell_of_bench(self) -> None:
        shape = self.bench()
        if shape != self._bench_told:
            self._bench_told = shape
            self._tell(wire.WorldChanged(shape))

    def state(self) -> Groups:
        """Everything that is shown live, as of now."""
        if not self._looking():
            self._sampled.resume()
        self._looked_s = self.server.pace.monotonic()
        self.server.catch_up()
        state, shown = empty(), self._shown
        self._put_time(state, shown.module)
        shown.put_program(state, held=self._held)
        for motor in range(MOTORS):
            shown.put_motor(state, motor)
        shown.put_board(state)
        off = 0 if shown.module.powered else ALL_UNKNOWN
        put(state, "quality", off, off, off, off & 0xFFFF, 0, NOW)
        self.server.settle()
        self._note()
        return state

    def _put_time(self, state: Groups, module: FirmwareModule) -> None:
        pace, now = self.server.pace, module.now
        wall_s = pace.monotonic()
        if self._seen is None:
            self._seen = now, wall_s
        elif wall_s - self._seen[1] >= 0.25:
            self._speed = (now - self._seen[0]) / clock.HZ / (wall_s - self._seen[1])
            self._seen = now, wall_s
        speed = 0.0 if pace.paused else round(self._speed, 2)
        past = self.past.shown
        foreign = past and module.eeprom.program != self.module.eeprom.program
        flags = bits(pace.paused, module.powered, self.plugged, past, foreign)
        put(state, "time", now, speed, pace.speed, flags)

    def _note(self) -> None:
        """Tell of what a plot should mark: the program's state, the switches, and the power."""
        before, self._notable = self._notable, notable(self.module)
        for kind, motor, text in changes(before, self._notable):
            event = wire.Happened(self.rig.now, kind, motor, text)
            self.past.note(event)
            self._tell(event)

    # The bench

    def set_bench(self, call: wire.SetBench) -> None:
        """Do what a hand would do."""
        self.server.catch_up()
        if call.what == "line":
            self.plugged = bool(call.value)
        else:
            self.hands.do(call)
        self.server.settle()

    def set_time(self, call: wire.SetTime) -> None:
        """Hold time, let it go, change its speed."""
        if call.speed is not None and not 0 <= call.speed <= MOST_SPEED:
            raise wire.RefusalError("range", f"The speed of time is 0..{MOST_SPEED:g}.")
        self.server.change_pace(speed=call.speed, paused=call.paused)
        self._seen = None
        self._speed = self.server.pace.speed

    def step_time(self, call: wire.StepTime) -> None:
        """Let a little time pass, and hold it."""
        self.server.change_pace(paused=True)
        span = max(0.0, min(LONGEST_STEP_MS, call.ms))
        part, end = self.server.part, self.rig.now + round(span * clock.MS)
        while (when := part.next_event()) <= end:
            part.advance(when)
        part.advance(end)
        self.server.pace.draw(self.rig.now)
        self.server.settle()

    def eeprom(self) -> wire.Eeprom:
        """The module's memory."""
        return self._shown.eeprom(self._memory_file)
