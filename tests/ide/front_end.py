"""The built page for tests: brought up to date once, whichever test asks first."""

from __future__ import annotations

import fcntl
import importlib.util
from functools import cache
from pathlib import Path
from types import ModuleType
from typing import Any

ROOT = Path(__file__).parents[2]
WEB = ROOT / "web"


def _hook() -> ModuleType:
    spec = importlib.util.spec_from_file_location("hatch_build", ROOT / "hatch_build.py")
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


hook: Any = _hook()
NODE: str = hook.tools()[0]


@cache
def built() -> Path:
    """The folder of the built page."""
    hook.OUT.mkdir(parents=True, exist_ok=True)
    with (hook.OUT / ".lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        hook.build()
    return hook.OUT
