"""The present, and what must wait while a past moment of a virtual module is shown."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from tmcm34x.ide import wire
from tmcm34x.ide.past import NOT_NOW, Past
from tmcm34x.ide.virtual import Virtual

if TYPE_CHECKING:
    from tmcm34x.ide.target import Target

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
