"""What pages ask of the history of a virtual module."""

from __future__ import annotations

from collections.abc import Awaitable, Callable, Mapping
from typing import TYPE_CHECKING, Final

from tmcm34x.ide import wire
from tmcm34x.ide.bench_calls import bench_of

if TYPE_CHECKING:
    from tmcm34x.ide.hub import Hub
    from tmcm34x.ide.window import Window


async def _show_past(hub: Hub, page: Window, call: wire.ShowPast) -> None:
    bench_of(hub).past.show(call.clock, call.branch)
    hub.hurry()


async def _leave_past(hub: Hub, page: Window, call: wire.LeavePast) -> None:
    bench_of(hub).past.leave()
    hub.hurry()


async def _go_on(hub: Hub, page: Window, call: wire.GoOn) -> None:
    bench_of(hub).past.go_on(hold=call.hold)
    await hub.begin_anew()


async def _read_marks(hub: Hub, page: Window, call: wire.ReadMarks) -> wire.Marks:
    return bench_of(hub).past.marks(call.branch)


METHODS: Final[Mapping[type[wire.Call], Callable[..., Awaitable[object]]]] = {
    wire.ShowPast: _show_past, wire.LeavePast: _leave_past, wire.GoOn: _go_on, wire.ReadMarks: _read_marks,
}  # fmt: skip
