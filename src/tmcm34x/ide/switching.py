"""From one module to another while the IDE runs, with all windows: what was begun on the old one is ended first."""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable, Mapping
from typing import TYPE_CHECKING, Final, Protocol

from tmcm34x.host.exceptions import LinkError
from tmcm34x.host.url import Url, parse_url
from tmcm34x.ide import wire
from tmcm34x.ide.modules import Recipe
from tmcm34x.ide.remote import Remote
from tmcm34x.ide.scanning import Scanning
from tmcm34x.ide.virtual import Virtual

if TYPE_CHECKING:
    from tmcm34x.ide.modules import Modules
    from tmcm34x.ide.target import Target
    from tmcm34x.ide.window import Window
    from tmcm34x.ide.workspace import OpenFolder


class Switched(Protocol):
    """What is connected to one module or another: the `Hub`."""

    target: Target
    workspace: OpenFolder

    def expect_idle(self) -> None:
        """Refuse while a download is under way."""
        ...

    def tell(self, event: wire.Event) -> None:
        """Send an event to all windows."""
        ...

    async def leave_target(self) -> str:
        """Bring the module to rest and hang up; what is not known to be at rest."""
        ...

    async def take_up(self, target: Target) -> None:
        """Go on with another module."""
        ...


class Switching:
    """Connects `hub` to what pages ask for, as far as `modules` allows it."""

    def __init__(self, hub: Switched, modules: Modules) -> None:
        self._hub = hub
        self._modules = modules
        self._lock = asyncio.Lock()
        self.scanning = Scanning(modules, self._in_use)

    # Real modules

    async def connect(self, page: Window, call: wire.Connect) -> None:
        """Go to a real module; one that does not answer only when asked for by `anyway`."""
        url = _url(call.url)
        self._modules.expect_open(url)
        async with self._lock:
            self._hub.expect_idle()
            self.scanning.cancel()
            await (self._reopen if self._is_here(url) else self._change)(url, call.anyway)

    async def _change(self, url: Url, anyway: bool) -> None:
        """To another line: the old one is kept until the new one is there."""
        target = await self._opened(url, anyway)
        self._hub.expect_idle()
        await self._leave()
        await self._hub.take_up(target)

    async def _reopen(self, url: Url, anyway: bool) -> None:
        """The same line with another rate or address: it has only one owner at a time."""
        before = self._hub.target
        assert isinstance(before, Remote)
        await self._leave()
        try:
            target = await self._opened(url, anyway)
        except wire.RefusalError:
            await self._hub.take_up(await asyncio.to_thread(self._modules.real, before.url, patient=True))
            raise
        await self._hub.take_up(target)

    async def _opened(self, url: Url, anyway: bool) -> Remote:
        try:
            target = await asyncio.to_thread(self._modules.real, url, patient=anyway)
        except LinkError as error:
            raise wire.RefusalError("line", f"{error}.") from error
        if target.link.up or anyway:
            return target
        await target.close()
        raise wire.RefusalError("silent", target.link.text)

    def _in_use(self) -> Url | None:
        """The line of the module that the IDE is connected to."""
        target = self._hub.target
        return target.url if isinstance(target, Remote) else None

    def _is_here(self, url: Url) -> bool:
        here = self._in_use()
        return here is not None and here.target == url.target

    # Virtual modules

    async def use_virtual(self, page: Window, call: wire.UseVirtual) -> None:
        """Go to a virtual module, with a bench from the folder or from the text of a page."""
        recipe = self._recipe(call)
        self._modules.expect_virtual(recipe)
        async with self._lock:
            self._hub.expect_idle()
            await self._leave()
            try:
                target = self._modules.virtual(recipe, keep=call.keep)
            except wire.RefusalError:
                await self._hub.take_up(self._modules.virtual(Recipe(), keep=False))
                raise
            await self._hub.take_up(target)

    def _recipe(self, call: wire.UseVirtual) -> Recipe:
        model = call.model or self._modules.recipe.model
        if not call.bench:
            return Recipe(model)
        text = call.text or self._hub.workspace.read(call.bench).text
        return Recipe(model, text, call.bench)

    # Between them

    async def _leave(self) -> None:
        """Bring to rest what was started, and close the line."""
        hub = self._hub
        place = hub.target.place
        doubts = await hub.leave_target()
        self._modules.remember(hub.target)
        if doubts:
            text = f"{place} was left, and is not known to be at rest: {doubts}"
            hub.tell(wire.Output("error", text))

    async def open_links(self, target: Target) -> list[str]:
        """Open the lines on which other hosts reach a virtual module; kind and address of each."""
        return await self._modules.open_links(target) if isinstance(target, Virtual) else []

    # Looking for modules

    async def list_ports(self, page: Window, call: wire.ListPorts) -> wire.Ports:
        """What this computer has."""
        return await asyncio.to_thread(self.scanning.ports)

    async def scan(self, page: Window, call: wire.Scan) -> None:
        """Begin to look for modules."""
        self.scanning.begin(page, [_url(port) for port in call.ports], far=call.far)

    async def stop_scan(self, page: Window, call: wire.StopScan) -> None:
        """Look no more."""
        self.scanning.cancel()


def _url(text: str) -> Url:
    try:
        return parse_url(text.strip())
    except LinkError as error:
        raise wire.RefusalError("url", f"{error}.") from error


METHODS: Final[Mapping[type[wire.Call], Callable[..., Awaitable[object]]]] = {
    wire.Connect: Switching.connect, wire.UseVirtual: Switching.use_virtual, wire.ListPorts: Switching.list_ports,
    wire.Scan: Switching.scan, wire.StopScan: Switching.stop_scan,
}  # fmt: skip
