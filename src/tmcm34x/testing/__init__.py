"""Modules for tests of host software: in virtual time or at real pace, or real ones, behind one interface.

    from tmcm34x.testing import VirtualModule

    with VirtualModule(343) as module:
        driver = Driver(module.port)      # host code under test, on a serial port
        driver.home()
        assert module.motor(0).position == 0

The pytest plugin (`tmcm34x.pytest_plugin`) makes fixtures of them; docs/testing.md explains both.

`motor`     one motor, as tests see it
`base`      what virtual and real modules share
`errors`    what they raise
`background`  an event loop on a thread of its own
`lines`     links in virtual time: time moves on by the bytes on the line and while the host waits
`virtual`   a virtual module, or a whole bench
`real`      a real module
`history` the past of a bench: conditions, going back, the last write
`registration`  the URL `tmcm34x://343` of pyserial made known
`report`    what a failed test shows
`protocol_tmcm34x`  what that URL opens
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from tmcm34x.testing.base import ModuleUnderTest
    from tmcm34x.testing.errors import NotOnRealModuleError, TooLateError
    from tmcm34x.testing.history import History
    from tmcm34x.testing.motor import Motor
    from tmcm34x.testing.real import RealModule
    from tmcm34x.testing.registration import register_url
    from tmcm34x.testing.virtual import VirtualModule

__all__ = [
    "History",
    "ModuleUnderTest",
    "Motor",
    "NotOnRealModuleError",
    "RealModule",
    "TooLateError",
    "VirtualModule",
    "register_url",
]

_HOMES = {
    "History": "history",
    "ModuleUnderTest": "base",
    "Motor": "motor",
    "NotOnRealModuleError": "errors",
    "RealModule": "real",
    "TooLateError": "errors",
    "VirtualModule": "virtual",
    "register_url": "registration",
}


def __getattr__(name: str) -> Any:
    if name in _HOMES:
        return getattr(import_module(f"{__name__}.{_HOMES[name]}"), name)
    raise AttributeError(name)
