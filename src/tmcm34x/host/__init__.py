"""The host's side of the wire: talk to a module, virtual or real, over a serial port, TCP, or in this process.

Read in this order: `exceptions`, `stream`, `connection`, `module`, `program`.
"""

from tmcm34x.host.connection import Connection
from tmcm34x.host.exceptions import (
    GarbledReplyError,
    HostError,
    LinkError,
    NoReplyError,
    RefusedError,
    ReplyError,
    VerifyError,
)
from tmcm34x.host.module import Axis, Module
from tmcm34x.host.program import Program, State
from tmcm34x.host.stream import MemoryStream, Stream, open_stream

__all__ = [
    "Axis",
    "Connection",
    "GarbledReplyError",
    "HostError",
    "LinkError",
    "MemoryStream",
    "Module",
    "NoReplyError",
    "Program",
    "RefusedError",
    "ReplyError",
    "State",
    "Stream",
    "VerifyError",
    "open_stream",
]
