"""A module's settings as files, by the host library: complete, or with a list of what is missing."""

from __future__ import annotations

from collections.abc import Awaitable, Callable
from typing import TYPE_CHECKING, Literal

from tmcm34x.host import settings
from tmcm34x.host.exceptions import FileError, HostError
from tmcm34x.host.items import settings_items
from tmcm34x.host.steps import executing
from tmcm34x.ide import wire
from tmcm34x.ide.chosen import text_of
from tmcm34x.ide.driving import run

if TYPE_CHECKING:
    from tmcm34x.ide.target import Target, Tell
    from tmcm34x.tmcl.datagram import Instruction


async def export_settings(target: Target, tell: Tell, form: Literal["tmcl", "toml"]) -> str:
    """All stored settings as text; `tell` takes a message where some could not be read.

    Raises `wire.RefusalError` where the module stores the questions instead of answering them.
    """
    model = target.model

    def progress(done: int, total: int) -> None:
        tell(wire.Progress("Reading settings", done, total))

    try:
        await run(target.ask, executing())
        readings = await run(target.ask, settings.read(settings_items(model.number), progress))
    except HostError as error:
        raise wire.RefusalError("module", f"The settings cannot be read: {error}.") from error
    missing = settings.missing(readings)
    if missing:
        text = f"The export is not complete: {len(missing)} settings could not be read: {missing[0]}"
        tell(wire.Output("error", text))
    write = settings.to_tmcl if form == "tmcl" else settings.to_toml
    return write(model.number, model.version, readings)


async def import_settings(
    exchange: Callable[[Instruction], Awaitable[wire.Exchange]],
    tell: Tell,
    call: wire.ImportSettings,
    model: int,
) -> wire.Imported:
    """Set what a file of `export_settings` says.  Raises `wire.RefusalError`, also where not all was answered."""
    try:
        found = settings.from_text(text_of(call.file), model)
    except FileError as error:
        raise wire.RefusalError("settings", f"{error}.") from error
    if found.model not in {None, model} and not call.sure:
        text = f"The settings are of a TMCM-{found.model}, the module is a TMCM-{model}"
        raise wire.RefusalError("confirm", f"{text}: what both have is set, the rest is left out.")
    for name in found.skipped:
        tell(wire.Output("information", f"Not imported: {name}"))

    def progress(done: int, total: int) -> None:
        tell(wire.Progress("Importing", done, total))

    try:
        await run(exchange, executing())
        failures = await run(exchange, settings.apply(found.values, progress))
    except HostError as error:
        raise wire.RefusalError("module", f"The import is not complete: {error}.") from error
    finally:
        tell(wire.Progress("", 1, 1))
    return wire.Imported(len(found.values), [f"{failure.item.path}: {failure.why}" for failure in failures])
