"""A module's settings as files, by the host library: complete, or with a list of what is missing."""

from __future__ import annotations

from collections.abc import Awaitable, Callable
from typing import TYPE_CHECKING, Literal

from tmcm34x.host import settings
from tmcm34x.host.exceptions import FileError, HostError
from tmcm34x.host.items import settings_items
from tmcm34x.ide import wire
from tmcm34x.ide.driving import run

if TYPE_CHECKING:
    from tmcm34x.ide.target import Target, Tell
    from tmcm34x.tmcl.datagram import Instruction


async def export_settings(target: Target, tell: Tell, form: Literal["tmcl", "toml"]) -> str:
    """All stored settings as text; `tell` takes a message where some could not be read."""
    model = target.model
    readings = await run(target.exchange, settings.read(settings_items(model.number)))
    missing = settings.missing(readings)
    if missing:
        text = f"The export is not complete: {len(missing)} settings could not be read: {missing[0]}"
        tell(wire.Output("error", text))
    write = settings.to_tmcl if form == "tmcl" else settings.to_toml
    return write(model.number, model.version, readings)


async def import_settings(
    exchange: Callable[[Instruction], Awaitable[wire.Exchange]], tell: Tell, text: str, model: int
) -> list[wire.Exchange]:
    """Set what a text of `export_settings` says; the exchanges that set something.  Raises `wire.RefusalError`."""
    try:
        found = settings.from_text(text, model)
    except FileError as error:
        raise wire.RefusalError("settings", f"{error}.") from error
    exchanges: list[wire.Exchange] = []

    async def noted(instruction: Instruction) -> wire.Exchange:
        done = await exchange(instruction)
        if any(instruction[:3] == item.write[:3] for item in found.values):
            exchanges.append(done)
        return done

    for name in found.skipped:
        tell(wire.Output("information", f"Not imported: {name}"))
    try:
        await run(noted, settings.apply(found.values))
    except HostError as error:
        raise wire.RefusalError("module", f"The import is not complete: {error}.") from error
    return exchanges
