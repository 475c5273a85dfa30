"""The IDE's middle: one module, one folder, any number of windows that see the same.

What pages ask for is done by the functions in `calls`, over what stands here.
"""

from __future__ import annotations

import asyncio
import secrets
from collections.abc import Mapping
from contextlib import suppress
from typing import TYPE_CHECKING, Any, Final

from tmcm34x import __version__
from tmcm34x.firmware.program import AddressCounts
from tmcm34x.host.steps import RESET, RUN, STOP
from tmcm34x.ide import present, wire
from tmcm34x.ide.authority import Authority
from tmcm34x.ide.building import Built, build, recognise
from tmcm34x.ide.debugger import Debugger
from tmcm34x.ide.folder import Folder
from tmcm34x.ide.loading import Loading
from tmcm34x.ide.modules import Modules, plain
from tmcm34x.ide.permission import permission
from tmcm34x.ide.remote import Remote
from tmcm34x.ide.switching import Switching
from tmcm34x.ide.virtual import Virtual
from tmcm34x.ide.vocabulary import model_shape, tables
from tmcm34x.tmcl.datagram import Instruction

if TYPE_CHECKING:
    from tmcm34x.ide.target import Target
    from tmcm34x.ide.telegrams import Telegrams
    from tmcm34x.ide.window import Window
    from tmcm34x.ide.workspace import OpenFolder
    from tmcm34x.toolchain.assembler import Assembly

EACH_S: Final = 1.0
"""Between two messages about how far the history reaches."""


class Hub:
    """What all windows share."""

    def __init__(
        self,
        workspace: OpenFolder,
        target: Target,
        telegrams: Telegrams,
        show: list[str],
        modules: Modules | None = None,
        *,
        named: bool = True,
    ) -> None:
        self.workspace = workspace
        self.telegrams = telegrams
        self._seat(target)
        self.debugger = Debugger(
            target,
            workspace.folder,
            permission(lambda: self.authority, lambda: present.is_shown(self.target)),
            lambda: self.authority.free,
            self._take,
        )
        self.switching = Switching(self, modules or plain(telegrams))
        self.pages: set[Window] = set()
        self.links: list[str] = []
        """Kind and address of each line on which other hosts reach a virtual module."""
        self._building = asyncio.Lock()
        self._show = show
        self._named = named
        self._start = secrets.token_hex(8)
        self.folder = Folder(workspace, self.tell, lambda: bool(self.pages))
        self._tasks: set[asyncio.Task[None]] = set()

    async def open(self) -> None:
        """Begin."""
        await self._begin()
        self._spawn(self.folder.watch())
        self._spawn(self._follow_past())
        self._spawn(self.debugger.run(self.tell_mark, self.hurry))

    # The module

    _seats = 0

    def _seat(self, target: Target) -> None:
        """Take `target` as the module, with all that belongs to it."""
        self._seats += 1
        self.target = target
        self.authority = Authority(target, self.tell, self._program_stopped)
        self.loading = Loading(target, self.tell, self._hush)
        self.assembly: Assembly | None = None
        """What the module's program was assembled from, as far as that is known."""

    async def _begin(self) -> None:
        self._told = self._kind
        if isinstance(self.target, Virtual):
            self.target.on_upset = self._upset
        await self.target.open(self._from_target)
        self._watching = self._spawn(self.authority.watch())

    def _upset(self) -> None:
        """The power was switched, or the bench was brought to another state."""
        self._spawn(self.begin_anew())

    async def begin_anew(self) -> None:
        """Nothing on the module goes on as it did: forget what was begun, and see what it has in memory."""
        self.authority.forget()
        await self.debugger.release()
        await self.check_memory()
        self.hurry()

    async def leave_target(self) -> str:
        """Bring the module to rest and hang up; what is not known to be at rest."""
        self.debugger.rest(True)
        doubts = await self.authority.close()
        self._watching.cancel()
        await self.target.close()
        return doubts

    async def open_links(self) -> None:
        """Open the lines on which other hosts reach a virtual module."""
        self.links = await self.switching.open_links(self.target)

    async def take_up(self, target: Target) -> None:
        """Go on with another module, in all windows."""
        self._seat(target)
        self.debugger.move(target)
        await self._begin()
        try:
            await self.open_links()
        except wire.RefusalError as error:
            self.links = []
            self.tell(wire.Output("error", f"Other hosts cannot reach the module: {error}"))
        for page in self.pages:
            page.begin_anew()
            self._greet(page)
        self.watches_changed()
        self.hurry()
        self._spawn(self.debugger.renew())

    def halt(self) -> None:
        """The server ends: what was started through it is stopped at once."""
        self.loading.abort()
        self.authority.halt()

    async def close(self) -> str:
        """End: what was started is stopped, whatever must be saved is saved; what is not known to be at rest."""
        doubts = await self.authority.close()
        for task in self._tasks:
            task.cancel()
        await asyncio.gather(*self._tasks, return_exceptions=True)
        await self.target.close()
        return doubts

    def _spawn(self, work: Any) -> asyncio.Task[None]:
        task: asyncio.Task[None] = asyncio.create_task(work)
        self._tasks.add(task)
        task.add_done_callback(self._tasks.discard)
        return task

    # Pages

    def tell_mark(self, event: wire.Event) -> None:
        """Send an event of the debugger's to all pages; what it marks is in the history too."""
        if present.note(self.target, event):
            self.tell(event)

    def tell(self, event: wire.Event) -> None:
        """Send an event to all pages."""
        for page in self.pages:
            page.send(event)

    async def _follow_past(self) -> None:
        """Have windows know how far the history reaches."""
        told: wire.History | None = None
        while True:
            past = present.past_of(self.target)
            shape = past.shape if past is not None and self.pages else None
            if shape is not None and shape != told:
                self.tell(shape)
            told = shape
            await asyncio.sleep(EACH_S)

    @property
    def _kind(self) -> tuple[int, bool]:
        return self.target.model.number, self.target.known

    def _from_target(self, event: wire.Event) -> None:
        """Send an event of the target's; a module that turns out to be of another model makes pages begin anew."""
        if isinstance(event, wire.Link):
            self.debugger.rest(event.ascii or self.loading.busy)
            if event.up and self.loading.listing is not None:
                self._spawn(self._look_again(self.loading))
        if self._kind != self._told:
            self._told = self._kind
            for page in self.pages:
                page.send(self.welcome(page.number))
        self.tell(event)

    def hurry(self) -> None:
        """Something happened that people wait for: show the state now."""
        for page in self.pages:
            page.hurry()

    def join(self, page: Window) -> None:
        """A window opens."""
        self.pages.add(page)
        self._greet(page)
        self.tell(wire.Windows(len(self.pages)))

    def _greet(self, page: Window) -> None:
        page.send(self.welcome(page.number))
        page.send(self.target.link)
        page.send(self.authority.shape)
        past = present.past_of(self.target)
        if past is not None:
            page.send(past.shape)

    def leave(self, page: Window) -> None:
        """A window closes."""
        self.pages.discard(page)
        self.switching.scanning.leave(page)
        self.authority.leave(page)
        self.tell(wire.Windows(len(self.pages)))
        self.watches_changed()

    def watches_changed(self) -> None:
        """Some page watches other parameters."""
        self.target.watch([item for page in self.pages for item in page.watches])

    def welcome(self, window: int) -> wire.Welcome:
        """What a new window must know."""
        target = self.target
        return wire.Welcome(
            protocol=wire.PROTOCOL,
            product=f"tmcm34x {__version__}",
            start=self._start,
            folder=str(self.workspace.folder),
            open=self._show,
            source=target.source,
            module=target.place,
            model=model_shape(target.model, known=target.known),
            ability=target.ability,
            tables=tables(target.model.number),
            listing=self.loading.listing,
            links=self.links,
            window=window,
            seat=self._seats,
            url=target.url.name if isinstance(target, Remote) else "",
            named=self._named,
        )

    def expect_idle(self) -> None:
        """Refuse what a module would store as part of the program that is being downloaded."""
        if self.loading.busy:
            raise wire.RefusalError("busy", "A download is under way: the module would store this command.")

    # Programs

    async def build(
        self, path: str, texts: Mapping[str, str], options: wire.BuildOptions, *, as_part: bool = False
    ) -> Built:
        """Assemble and check a program; see `building.build`.  One at a time: two take as long together."""
        async with self._building:
            return await asyncio.to_thread(
                build, self.workspace, path, texts, options.model or self.target.model.number,
                as_part=as_part, append_stop=options.append_stop,
            )  # fmt: skip

    def _hush(self, on: bool) -> None:
        """Send nothing of our own accord: the module would store it."""
        self.target.hush(on)
        self.debugger.rest(on)
        self.authority.quiet = on

    async def adopt(
        self, listing: wire.Listing | None, assembly: Assembly | None, *, by_other_host: bool = False
    ) -> None:
        """From now on the module's program is this one, and comes from this source, if it is known."""
        before, self.assembly = self.loading.listing, assembly
        self.loading.know(listing)
        if listing is None or before is None or before.identity != listing.identity:
            _count_anew(self.target)
        await self.debugger.know(assembly)
        self.tell(wire.Loaded(listing, by_other_host))

    async def check_memory(self) -> None:
        """Check whether another host has stored another program meanwhile."""
        loading = self.loading
        program = loading.stored_by_other_host()
        if program is None:
            return
        seen = loading.revision
        found = await asyncio.to_thread(recognise, self.workspace, program, self.target.model.number)
        if loading is self.loading and not loading.busy and loading.revision == seen:
            await self.adopt(*found, by_other_host=True)

    async def _look_again(self, loading: Loading) -> None:
        """A real module is there again: it may hold another program meanwhile, or be another module."""
        program = () if self.assembly is None else self.assembly.program
        with suppress(wire.RefusalError):
            if not loading.busy and not await loading.holds(program) and loading is self.loading:
                await self.adopt(None, None, by_other_host=True)

    # Running

    async def control(self, action: str) -> None:
        """Run, stop or reset the program."""
        if action == "run":
            self.authority.permit_program()
            if await self.debugger.start_in_steps():
                return
        for number in _CONTROL[action]:
            await self.loading.command(Instruction(number))
        await self.debugger.release()

    def _take(self, instruction: Instruction) -> None:
        self.authority.take(instruction)

    async def _program_stopped(self) -> None:
        await self.debugger.release()


_CONTROL: Final[Mapping[str, tuple[int, ...]]] = {"run": (RESET, RUN), "stop": (STOP,), "reset": (RESET,)}
"""Control functions by action."""


def _count_anew(target: Target) -> None:
    """The program is another one: what was executed of the former is forgotten."""
    if isinstance(target, Virtual) and target.module.program.counts is not None:
        target.module.program.count(AddressCounts())
