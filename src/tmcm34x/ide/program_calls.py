"""What pages ask about the program that is to be in the module: assemble, download, run."""

from __future__ import annotations

from collections.abc import Awaitable, Callable, Mapping
from typing import TYPE_CHECKING, Final

from tmcm34x.ide import wire

if TYPE_CHECKING:
    from tmcm34x.ide.hub import Hub
    from tmcm34x.ide.window import Window


async def _assemble(hub: Hub, page: Window, call: wire.Assemble) -> wire.Assembled:
    return (await hub.build(call.path, call.texts, call.options, as_part=True)).answer


async def _download(hub: Hub, page: Window, call: wire.Download) -> wire.Assembled:
    answer, assembly = await hub.build(call.path, call.texts, call.options)
    program = assembly.program
    if answer.listing is None:
        return answer
    hub.expect_idle()
    if not program:
        raise wire.RefusalError("empty", f"{call.path} has no instructions.")
    if call.run:
        hub.authority.permit_program()
    await hub.check_memory()
    await hub.authority.settle()
    await hub.loading.put(answer.listing, program, replace=call.replace)
    await hub.adopt(answer.listing, assembly)
    if call.run:
        await hub.control("run")
    return answer


async def _control_program(hub: Hub, page: Window, call: wire.ControlProgram) -> None:
    hub.expect_idle()
    await hub.control(call.action)


METHODS: Final[Mapping[type[wire.Call], Callable[..., Awaitable[object]]]] = {
    wire.Assemble: _assemble, wire.Download: _download, wire.ControlProgram: _control_program,
}  # fmt: skip
