"""What pages ask of the history of a virtual module, and what they may not ask while a past moment is shown."""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable, Mapping
from typing import TYPE_CHECKING, Final

from tmcm34x.ide import wire
from tmcm34x.ide.bench_calls import bench_of
from tmcm34x.ide.past import NOT_NOW, Past
from tmcm34x.ide.virtual import Virtual

if TYPE_CHECKING:
    from tmcm34x.ide.hub import Hub
    from tmcm34x.ide.page import Page
    from tmcm34x.ide.target import Target

EACH_S: Final = 1.0
"""Between two messages about how far the history reaches."""
HELD_BACK: Final = (
    wire.Download, wire.Upload, wire.Adopt, wire.Why, wire.ControlProgram, wire.Execute, wire.ExecuteText,
    wire.SendAscii, wire.Zero, wire.Search, wire.Go, wire.Turn, wire.Profile, wire.Keep, wire.Jog, wire.Stride,
    wire.SetBench, wire.SetTime, wire.StepTime, wire.ExportSettings, wire.ImportSettings,
)  # fmt: skip
"""Calls that reach the module or its bench: they are of the present."""


def past_of(target: Target) -> Past | None:
    """The history of a virtual module."""
    return target.past if isinstance(target, Virtual) else None


def is_shown(target: Target) -> bool:
    """Whether a past moment is shown."""
    past = past_of(target)
    return past is not None and past.shown


def expect_present(target: Target, call: wire.Call) -> None:
    """Refuse what reaches the module or its bench while a past moment is shown; STOP ALL ends that."""
    past = past_of(target)
    if past is not None and past.shown:
        if isinstance(call, HELD_BACK):
            raise wire.RefusalError("past", NOT_NOW)
        if isinstance(call, wire.StopAll):
            past.leave()


def note(target: Target, event: wire.Event) -> bool:
    """Keep what the debugger marks; whether it is of the present."""
    past = past_of(target)
    if past is None or not isinstance(event, wire.Happened):
        return True
    if not past.shown:
        past.note(event)
    return not past.shown


async def follow(hub: Hub) -> None:
    """Have windows know how far the history reaches."""
    told: wire.History | None = None
    while True:
        past = past_of(hub.target)
        shape = past.shape if past is not None and hub.pages else None
        if shape is not None and shape != told:
            hub.tell(shape)
        told = shape
        await asyncio.sleep(EACH_S)


async def _show_past(hub: Hub, page: Page, call: wire.ShowPast) -> None:
    bench_of(hub).past.show(call.clock, call.branch)
    hub.hurry()


async def _leave_past(hub: Hub, page: Page, call: wire.LeavePast) -> None:
    bench_of(hub).past.leave()
    hub.hurry()


async def _go_on(hub: Hub, page: Page, call: wire.GoOn) -> None:
    bench_of(hub).past.go_on(hold=call.hold)
    await hub.begin_anew()


async def _read_marks(hub: Hub, page: Page, call: wire.ReadMarks) -> wire.Marks:
    return bench_of(hub).past.marks(call.branch)


METHODS: Final[Mapping[type[wire.Call], Callable[..., Awaitable[object]]]] = {
    wire.ShowPast: _show_past, wire.LeavePast: _leave_past, wire.GoOn: _go_on, wire.ReadMarks: _read_marks,
}  # fmt: skip
