"""The modules that the IDE can be connected to while it runs, and which of them a page may ask for.

A page comes from a browser: it may open what this computer lists as its serial ports, pseudo terminals, sockets and
CAN buses, and only where the server is on loopback (docs/decisions/0013).  Virtual modules it may always ask for.
"""

from __future__ import annotations

import re
from collections.abc import Awaitable, Callable, Generator, Sequence
from contextlib import contextmanager
from typing import TYPE_CHECKING, Final, NamedTuple

from tmcm34x.files import real_path
from tmcm34x.host.scan import serial_ports
from tmcm34x.ide import wire
from tmcm34x.ide.remote import Remote

if TYPE_CHECKING:
    from tmcm34x.bench import Rig
    from tmcm34x.firmware.storage import Eeprom
    from tmcm34x.host.url import Url
    from tmcm34x.ide.target import Target
    from tmcm34x.ide.telegrams import Telegrams
    from tmcm34x.ide.virtual import Virtual

BARE: Final = "bare motors"
_PSEUDO_TERMINAL: Final = re.compile(r"/dev/(pts/|ttys)\d+\Z")
_SERIAL_URLS: Final = frozenset({"socket", "rfc2217"})
"""Schemes of pyserial's URLs that lead to a socket and nowhere else."""
_ADAPTERS: Final = frozenset({"slcan", "serial", "robotell", "seeedstudio"})
"""Interfaces of python-can whose channel is a serial port."""


class Recipe(NamedTuple):
    """A virtual module: a model on bare motors, or what the text of a bench file says."""

    model: int = 343
    bench: str = ""
    name: str = BARE


Make = Callable[[Recipe, Sequence["Eeprom | None"], bool], "Virtual"]
"""Builds a virtual module with these memories; True for the file of the start as the first one's.

Raises `BenchError`, `EepromError`.
"""


def rig_of(recipe: Recipe, memories: Sequence[Eeprom | None]) -> Rig:
    """The rig of a recipe, switched on.  Raises `BenchError`, `EepromError`."""
    from tmcm34x.bench import build, simple_rig
    from tmcm34x.bench.description import parse

    if recipe.bench:
        return build(parse(recipe.bench), memories)
    return simple_rig(recipe.model, next(iter(memories), None))


def _models(recipe: Recipe) -> list[int]:
    from tmcm34x.bench.description import parse

    return [module.model for module in parse(recipe.bench).module] if recipe.bench else [recipe.model]


class Modules:
    """What the IDE can be connected to.

    make: builds virtual modules
    open_links: opens the lines on which other hosts reach a virtual module; returns kind and address of each
    local: the server is on loopback
    named: the line that the server was started with, which pages may always open
    """

    def __init__(
        self,
        telegrams: Telegrams,
        make: Make,
        open_links: Callable[[Virtual], Awaitable[list[str]]],
        *,
        local: bool = True,
        named: Url | None = None,
        recipe: Recipe | None = None,
    ) -> None:
        self._telegrams = telegrams
        self._make = make
        self.open_links = open_links
        self.local = local
        self._named = named
        self.recipe = recipe or Recipe()
        """Of the virtual module that is, or was last, in use."""
        self._memories: list[Eeprom | None] = []

    @property
    def closed(self) -> str:
        """Why pages may open no lines; empty where they may."""
        if self.local:
            return ""
        return (
            "This server can be reached from other computers, so its pages open no ports: name one by --port."
        )

    def expect_open(self, url: Url) -> None:
        """Refuse a line that pages may not open."""
        if self._named is not None and (url.scheme, url.target) == self._named[:2]:
            return
        if why := self.closed or _forbidden(url):
            raise wire.RefusalError("port", why)

    def real(self, url: Url, *, patient: bool = False) -> Remote:
        """The module that `url` names; blocks while the line is opened.  Raises `LinkError`."""
        return Remote(url, self._telegrams, patient=patient)

    def expect_virtual(self, recipe: Recipe) -> None:
        """See whether there can be such a virtual module.  Raises `wire.RefusalError`."""
        with _refusing():
            rig_of(recipe, [])

    def virtual(self, recipe: Recipe, *, keep: bool) -> Virtual:
        """A virtual module; `keep` with the memories of the last one.  Raises `wire.RefusalError`."""
        with _refusing():
            made = self._make(recipe, self._fitting(recipe) if keep else [], keep)
        self.recipe = recipe
        return made

    def _fitting(self, recipe: Recipe) -> list[Eeprom | None]:
        """For each module of a recipe the memory in its place, where that is of its model."""
        models = _models(recipe)
        kept = [*self._memories, *[None] * len(models)]
        return [
            memory if memory is not None and memory.model == model else None
            for model, memory in zip(models, kept, strict=False)
        ]

    def remember(self, target: Target) -> None:
        """A module is left: keep what is in the memories of a virtual one."""
        from tmcm34x.firmware.storage import Eeprom
        from tmcm34x.ide.virtual import Virtual

        if isinstance(target, Virtual):
            images = [module.eeprom.to_bytes() for module in target.rig.modules]
            self._memories = [Eeprom.from_bytes(image) for image in images]


def plain(telegrams: Telegrams) -> Modules:
    """Modules without files for their memories and without lines for other hosts."""
    from tmcm34x.ide.virtual import Virtual
    from tmcm34x.server import Server

    def make(recipe: Recipe, memories: Sequence[Eeprom | None], keep: bool) -> Virtual:
        return Virtual(Server(rig_of(recipe, memories), log=telegrams), recipe.name, "")

    async def no_links(virtual: Virtual) -> list[str]:
        return []

    return Modules(telegrams, make, no_links)


@contextmanager
def _refusing() -> Generator[None]:
    """Turns what is wrong with a bench or a memory into a refusal."""
    from tmcm34x.bench import BenchError
    from tmcm34x.firmware.storage import EepromError

    try:
        yield
    except (BenchError, EepromError) as error:
        raise wire.RefusalError("bench", f"{error}.") from error


def _forbidden(url: Url) -> str:
    """Why a page may not open a line."""
    if url.scheme == "virtual":
        return "A virtual module is chosen as such, not by a URL."
    if not url.text.isprintable():
        return "This is no name of a line."
    port = url.target if url.scheme in {"serial", "slcan"} else _channel(url)
    if not port or _is_serial(port):
        return ""
    return (
        f"{port} is not among the serial ports of this computer: a page opens only those; "
        "name others by --port when the IDE is started."
    )


def _channel(url: Url) -> str:
    """The serial port that a CAN adapter hangs on; empty for all others."""
    interface, _, channel = url.target.partition(":")
    return channel if url.scheme == "can" and interface in _ADAPTERS else ""


def _is_serial(name: str) -> bool:
    scheme, url, _ = name.partition("://")
    if url:
        return scheme in _SERIAL_URLS
    port = name.partition("@")[0]  # python-can: DEVICE@BITRATE
    real = str(real_path(port))
    listed = serial_ports()
    return (
        port in listed
        or bool(_PSEUDO_TERMINAL.match(real))
        or real in {str(real_path(other)) for other in listed}
    )
