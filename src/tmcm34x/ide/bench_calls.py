"""What pages ask of the bench of a virtual module, and of the settings of any."""

from __future__ import annotations

from collections.abc import Awaitable, Callable, Mapping
from typing import TYPE_CHECKING, Final

from tmcm34x.ide import wire
from tmcm34x.ide.settings import export_settings, import_settings
from tmcm34x.ide.virtual import Virtual

if TYPE_CHECKING:
    from tmcm34x.ide.hub import Hub
    from tmcm34x.ide.window import Window
    from tmcm34x.tmcl.datagram import Instruction


def bench_of(hub: Hub) -> Virtual:
    """The virtual module; refused for a real one."""
    if not isinstance(hub.target, Virtual):
        raise wire.RefusalError("real", "Not available on a real module.")
    return hub.target


async def _set_bench(hub: Hub, page: Window, call: wire.SetBench) -> None:
    bench_of(hub).set_bench(call)


async def _set_time(hub: Hub, page: Window, call: wire.SetTime) -> None:
    bench_of(hub).set_time(call)


async def _step_time(hub: Hub, page: Window, call: wire.StepTime) -> None:
    bench_of(hub).step_time(call)


async def _read_world(hub: Hub, page: Window, call: wire.ReadWorld) -> wire.World:
    return bench_of(hub).bench()


async def _read_eeprom(hub: Hub, page: Window, call: wire.ReadEeprom) -> wire.Eeprom:
    return bench_of(hub).eeprom()


async def _export_settings(hub: Hub, page: Window, call: wire.ExportSettings) -> str:
    hub.expect_idle()
    return await export_settings(hub.target, hub.tell, call.format)


async def _import_settings(hub: Hub, page: Window, call: wire.ImportSettings) -> wire.Imported:
    async def exchange(instruction: Instruction) -> wire.Exchange:
        hub.expect_idle()
        hub.authority.permit(instruction)
        return await hub.target.ask(instruction)

    return await import_settings(exchange, hub.tell, call, hub.target.model.number)


METHODS: Final[Mapping[type[wire.Call], Callable[..., Awaitable[object]]]] = {
    wire.SetBench: _set_bench, wire.SetTime: _set_time, wire.StepTime: _step_time, wire.ReadWorld: _read_world,
    wire.ReadEeprom: _read_eeprom, wire.ExportSettings: _export_settings, wire.ImportSettings: _import_settings,
}  # fmt: skip
