"""The Debug Adapter Protocol over a program on a virtual module, or in a real one."""

from tmcm34x.debug.dap.adapter import Adapter, Services

__all__ = ["Adapter", "Services"]
