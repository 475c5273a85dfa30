"""Which core the benchmarks run on, for marks that depend on it."""

from __future__ import annotations

from tmcm34x import clock

COMPILED = not (clock.__file__ or "").endswith(".py")
NAME = "compiled" if COMPILED else "Python"


def mark(compiled: float, pure: float) -> float:
    """The mark for this core."""
    return compiled if COMPILED else pure
