"""The debugger of the IDE: one session of the Debug Adapter Protocol on the IDE's module, which all windows share.

The adapter is that of `tmcm34x dap`; windows speak the protocol with it, one message in each web socket message.
Four things differ, because there are many windows and one program:

- The session is there without any window: `attach`, `configurationDone` and `disconnect` only say that a window
  comes, is ready or goes.
- Events go to all windows, a response to the window that asked.
- What one window sets is sent to the others: `tmcl_breakpoints` (`source`, `breakpoints` as they were asked for,
  `placed` as the adapter answered), `tmcl_data_breakpoints` (the same without a source) and `tmcl_filters` (`filters`)
  are events of our own.  `tmcl_hits` (`hits`, by the number of the breakpoint) carries how often breakpoints were met.
- The breaks that are on unless an editor says otherwise are on before any window has chosen some.
"""

from __future__ import annotations

import asyncio
import contextlib
from collections.abc import Callable
from functools import partial
from typing import TYPE_CHECKING, Any, Final, NoReturn, cast

from tmcm34x.debug.dap import Adapter, Services
from tmcm34x.debug.dap.messages import RequestError
from tmcm34x.debug.sessions.live import LiveSession
from tmcm34x.debug.sessions.remote import RemoteSession
from tmcm34x.debug.sessions.search import UnfinishedError
from tmcm34x.host.effects import consequence
from tmcm34x.host.exceptions import HostError, LinkError
from tmcm34x.ide import wire
from tmcm34x.ide.debug_marks import Kept
from tmcm34x.ide.debug_messages import (
    DebugWindow,
    Emission,
    Message,
    event_of,
    is_logged,
    moves_program,
    request_of,
    response_to,
)
from tmcm34x.ide.searching import Searching

if TYPE_CHECKING:
    from pathlib import Path

    from tmcm34x.debug.control import Stop
    from tmcm34x.debug.sessions.base import Listener
    from tmcm34x.debug.sessions.search import PlaybackSearch
    from tmcm34x.ide.permission import Permit
    from tmcm34x.ide.target import Target, Tell
    from tmcm34x.tmcl.datagram import Instruction
    from tmcm34x.toolchain.assembler import Assembly

IDLE_S: Final = 0.1
"""Longest time between two looks at the program."""
MESSAGES: Final = 10
"""Most messages of log points that windows are sent in `IDLE_S`; the others are counted."""


class Debugger:
    """Run control of `target` for all windows.

    folder: where the names of source files begin
    permit: called before each request of a window
    free: whether motors may be set in motion, asked before each single step of a program that goes on in steps
    take: called with each command by which a window has written a value in a real module
    """

    def __init__(
        self,
        target: Target,
        folder: Path,
        permit: Permit,
        free: Callable[[], bool],
        take: Callable[[Instruction], None],
    ) -> None:
        self._target = target
        self._permit = permit
        self._free = free
        self._take = take
        self._services = Services(_no_program, _no_pace, self._session, folder)
        self._windows: set[DebugWindow] = set()
        self._adapter: Adapter | None = None
        self._line = 0
        """Number of the line that the adapter is attached to."""
        self._asker: DebugWindow | None = None
        self._request: Message = {}
        self._assembly: Assembly | None = None
        self._kept = Kept()
        self._searching = Searching()
        self._lock = asyncio.Lock()
        self._attaching = False
        self._resting = False
        self._messages = 0
        """Messages of log points since the last look."""
        self._stop: Stop | None = None
        """Why the program of the present is held, as of the last message."""
        self._hits: dict[int, int] = {}
        """Of breakpoints by their number, as windows have them."""
        self._loop: asyncio.AbstractEventLoop | None = None
        self._wake = asyncio.Event()
        self._tell: Tell = lambda event: None
        self._hurry: Callable[[], None] = lambda: None

    async def run(self, tell: Tell, hurry: Callable[[], None]) -> None:
        """Look after the program for ever; `hurry` is called when something happens that people wait for."""
        self._tell, self._hurry = tell, hurry
        self._loop = asyncio.get_running_loop()
        while True:
            self._tell_of_more()
            pause_s = IDLE_S
            if self._adapter is not None and not self._resting and self._watched:
                pause_s = min(IDLE_S, await self._work(self._adapter))
                self._tell_of_hits()
            with contextlib.suppress(TimeoutError):
                await asyncio.wait_for(self._wake.wait(), pause_s)
            self._wake.clear()

    @property
    def _watched(self) -> bool:
        """Whether a window looks at a module that answers, or the program goes on under this session."""
        target = None if self._adapter is None else self._adapter.target
        looking = bool(self._windows) and self._target.link.up
        return looking or (target is not None and target.running)

    def _session(self, listener: Listener) -> LiveSession | RemoteSession:
        """Run control that makes no step which authority does not permit."""
        session = self._target.session(listener)
        if isinstance(session, RemoteSession):
            session.permitted = self._free
            session.refused = self._refused
        return session

    def _refused(self, instruction: Instruction) -> str:
        """Why a value may not be written in a real module; called in the thread of its line."""
        if text := consequence(instruction):
            return f"{text}: change it in Parameters or in direct mode, which ask first"
        if not self._free():
            return "not armed, or STOP ALL holds"
        assert self._loop is not None
        self._loop.call_soon_threadsafe(self._take, instruction)
        return ""

    async def _work(self, adapter: Adapter) -> float:
        """Let the adapter look at the program; how long it needs no other look [s]."""
        try:
            return await self._target.debug(adapter.work, polling=True)
        except LinkError:
            return IDLE_S

    def rest(self, on: bool) -> None:
        """Leave the module alone: it would store what it is sent, or is about to be left."""
        self._resting = on
        if on:
            self._end_search()

    def move(self, target: Target) -> None:
        """Go on with another module; what windows have set is kept, and set there too."""
        self._target = target
        self._adapter = self._assembly = None
        self._resting = False

    async def renew(self) -> None:
        """Have windows know what becomes of their breakpoints on another module."""
        if self._windows and self._kept:
            with contextlib.suppress(HostError):
                await self._attach()

    # Windows

    async def handle(self, window: DebugWindow, message: Any) -> None:
        """Do what a window asks for."""
        fields = cast(Message, message) if isinstance(message, dict) else {}
        command = fields.get("command")
        if isinstance(command, str) and command in {"attach", "configurationDone", "disconnect"}:
            window.take(response_to(fields))
            self._greet(window, command)
        elif error := self._refuse(fields) or await self._forward(fields, window):
            window.take(response_to(fields, error))

    async def _forward(self, request: Message, window: DebugWindow) -> str:
        """Ask the adapter, which answers the window; why it was not asked."""
        try:
            if error := await self._attach():
                return error
            await self._ask(request, window)
        except LinkError as error:
            return str(error)
        self._wake.set()
        return ""

    def _refuse(self, fields: Message) -> str:
        """Why a request that could set motors in motion is not allowed."""
        arguments = fields.get("arguments")
        known = cast(Message, arguments) if isinstance(arguments, dict) else {}
        try:
            self._permit(str(fields.get("command")), known)
        except wire.RefusalError as error:
            return str(error)
        return ""

    def _greet(self, window: DebugWindow, command: str) -> None:
        """Tell a new window how things are."""
        if command == "disconnect":
            self.leave(window)
        elif command == "attach":
            self._windows.add(window)
            window.take(event_of("initialized"))
        else:
            for event in self._kept.events():
                window.take(event)
            window.take(event_of("tmcl_hits", hits=self._hits))

    def leave(self, window: DebugWindow) -> None:
        """A window is gone."""
        self._windows.discard(window)

    # The session

    async def _attach(self) -> str:
        """Make sure of a session with the line that there is now; why there is none."""
        if self._resting:
            return "the module is busy with a download"
        async with self._lock:
            if self._adapter is None or self._line != self._target.line:
                self._attaching = True
                try:
                    await self._attach_anew(Adapter(self._emitted, self._services))
                except LinkError:
                    self._adapter = None
                    raise
                finally:
                    self._attaching = False
        return "" if self._adapter is not None else self._target.link.text or "the module does not answer"

    async def _attach_anew(self, adapter: Adapter) -> None:
        self._adapter, self._line = adapter, self._target.line
        await self._ask(request_of("attach"))
        if adapter.target is None:
            self._adapter = None
            return
        await self._target.debug(lambda: adapter.know(self._assembly))
        for request in self._kept.requests():
            await self._ask(request)
        await self._ask(request_of("configurationDone"))

    async def _ask(self, request: Message, window: DebugWindow | None = None) -> None:
        adapter = self._adapter
        assert adapter is not None
        if moves_program(request):
            self._end_search()
        again = partial(self._try, adapter, request, window)
        if (search := await again()) is not None:
            self._searching.go_on(search, again, partial(self._give_up, request, window))

    async def _try(
        self, adapter: Adapter, request: Message, window: DebugWindow | None
    ) -> PlaybackSearch | None:
        """Have the adapter do it; the search along the past that has to run first, if there is one."""
        if adapter is not self._adapter:
            self._give_up(request, window)
            return None
        try:
            await self._target.debug(partial(self._handle, adapter, request, window))
        except UnfinishedError as unfinished:
            return unfinished.search
        return None

    def _handle(self, adapter: Adapter, request: Message, window: DebugWindow | None) -> None:
        self._asker, self._request = window, request
        try:
            adapter.handle(request)
        finally:
            self._asker, self._request = None, {}

    def _give_up(self, request: Message, window: DebugWindow | None) -> None:
        if window is not None:
            window.take(response_to(request, "given up: something else was asked for"))

    def _end_search(self) -> None:
        """Give up what is being looked for in the past, and forget what was found."""
        target = None if self._adapter is None else self._adapter.target
        if isinstance(target, LiveSession):
            target.end_search()

    async def know(self, assembly: Assembly | None) -> None:
        """The program in the module comes from this text."""
        self._assembly = assembly
        if self._adapter is not None:
            adapter = self._adapter
            with contextlib.suppress(LinkError):  # a download that begins now brings another program
                await self._target.debug(lambda: adapter.know(assembly))

    async def start_in_steps(self) -> bool:
        """Start the program from its beginning where breakpoints ask for single steps; whether they do."""
        if not await self._needs_steps():
            return False
        await self._ask(request_of("restart"))
        self._wake.set()
        return True

    async def _needs_steps(self) -> bool:
        if not self._kept.breakpoints or await self._attach():
            return False
        target = None if self._adapter is None else self._adapter.target
        return target is not None and bool(target.steps_for_breakpoints and target.hits())

    async def release(self) -> None:
        """The program was stopped, reset or started by a command."""
        if self._adapter is not None:
            with contextlib.suppress(HostError):
                await self._target.debug(self._adapter.release)
            self._wake.set()

    # From the adapter

    def _emitted(self, message: Message) -> None:
        """Called in whatever thread the module is."""
        assert self._loop is not None
        held = self._held_anew()
        emission = Emission(message, self._asker, self._request, self._target.now, held, self._attaching)
        self._loop.call_soon_threadsafe(self._deliver, emission)

    def _held_anew(self) -> Stop | None:
        """Why and where the program of the present is held, unless it was so at the last message."""
        target = None if self._adapter is None else self._adapter.target
        if target is None or (isinstance(target, LiveSession) and target.looking_back):
            return None
        before, self._stop = self._stop, target.stop
        return None if self._stop is before else self._stop

    def _deliver(self, emission: Emission) -> None:
        message = emission.message
        if message["type"] == "response":
            self._answered(emission)
            return
        if message["event"] == "breakpoint":
            self._kept.move(message["body"]["breakpoint"])
        if message["event"] == "terminated":
            self._adapter = None
        if is_logged(message):
            self._messages += 1
            if self._messages > MESSAGES:
                return
        if not emission.attaching:
            self._mark(emission)
        if not emission.attaching or message["event"] == "output":
            self._send(message)

    def _send(self, message: Message, *, but: DebugWindow | None = None) -> None:
        for window in self._windows:
            if window is not but:
                window.take(message)

    def _tell_of_more(self) -> None:
        """Say how many messages of log points were left out."""
        more, self._messages = self._messages - MESSAGES, 0
        if more > 0:
            self._send(
                event_of("output", category="console", output=f"... and {more} more messages\n", line=0)
            )

    def _tell_of_hits(self) -> None:
        hits = {} if self._adapter is None else self._adapter.hits()
        if hits != self._hits:
            self._hits = hits
            self._send(event_of("tmcl_hits", hits=hits))

    def _mark(self, emission: Emission) -> None:
        """What plots show, and what people wait for."""
        event, body = emission.message["event"], emission.message.get("body", {})
        if event == "stopped":
            self._hurry()
            if emission.held is not None:
                text = f"{emission.held.reason} at {emission.held.address}"
                self._tell(wire.Happened(emission.now, "held", -1, text))
        elif is_logged(emission.message):
            self._tell(wire.Happened(emission.now, "log", -1, body["output"].strip()))

    def _answered(self, emission: Emission) -> None:
        """Let the window have it; remember breakpoints, and let the other windows know of them."""
        message, asker = emission.message, emission.asker
        if asker is not None:
            asker.take(message)
        if not message["success"]:
            return
        event = self._kept.remember(
            message["command"], emission.request.get("arguments", {}), message.get("body", {})
        )
        if event is not None:
            self._send(event, but=asker)


def _no_program(path: str, include: object, model: int) -> NoReturn:
    raise RequestError("the IDE's module has a program already: download another one")


def _no_pace(speed: float) -> NoReturn:
    raise RequestError("the IDE's module has its own time")
