"""Everything that a host does with a module, virtual or real.

    from tmcm34x.host import connect

    with connect("serial:/dev/ttyUSB0?baud=9600&address=1", stop_on_error=True) as module:
        module.axes[0].move_to(51_200, wait=True)

Read in this order: `exceptions`, `reading`, `answer`, `protocol`, `steps`, `url`, `line`, `connection`, `aio`, then
what is done: `motion`, `program`, `module`, `items`, `settings`, `backup`, `restore`, `why`, `monitor`, `scan`.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any, Final

from tmcm34x.host.exceptions import (
    DamagedError,
    DownloadModeError,
    FileError,
    GarbledReplyError,
    HostError,
    LateReplyError,
    LinkError,
    LostLinkError,
    NoReplyError,
    NotAvailableError,
    NotReachedError,
    ProtectedError,
    RangeError,
    RefusedError,
    ReplyError,
    VerifyError,
)

if TYPE_CHECKING:
    from tmcm34x.host.aio import AsyncConnection
    from tmcm34x.host.connection import Connection
    from tmcm34x.host.line import Line
    from tmcm34x.host.module import Axis, Module, connect
    from tmcm34x.host.program import Program, ProgramState
    from tmcm34x.host.reading import Absent, Reading, Refused, Silent, Value

__all__ = [
    "Absent",
    "AsyncConnection",
    "Axis",
    "Connection",
    "DamagedError",
    "DownloadModeError",
    "FileError",
    "GarbledReplyError",
    "HostError",
    "LateReplyError",
    "Line",
    "LinkError",
    "LostLinkError",
    "Module",
    "NoReplyError",
    "NotAvailableError",
    "NotReachedError",
    "Program",
    "ProgramState",
    "ProtectedError",
    "RangeError",
    "Reading",
    "Refused",
    "RefusedError",
    "ReplyError",
    "Silent",
    "Value",
    "VerifyError",
    "connect",
]

_HOMES: Final = {
    "AsyncConnection": "aio",
    "Connection": "connection",
    "Line": "line",
    **dict.fromkeys(("Axis", "Module", "connect"), "module"),
    **dict.fromkeys(("Program", "ProgramState"), "program"),
    **dict.fromkeys(("Absent", "Reading", "Refused", "Silent", "Value"), "reading"),
}
"""Modules that are imported only when a name of theirs is used."""


def __getattr__(name: str) -> Any:
    if name in _HOMES:
        return getattr(import_module(f"tmcm34x.host.{_HOMES[name]}"), name)
    raise AttributeError(name)
