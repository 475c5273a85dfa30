"""Benches for tests and programs."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from tmcm34x.bench.rig import BenchError, simple_rig
from tmcm34x.board.models import MODELS
from tmcm34x.testing.errors import WrongUseError

if TYPE_CHECKING:
    from tmcm34x.bench.rig import Rig
    from tmcm34x.firmware.storage import Eeprom


def make_rig(model: int | None, bench: str | Path | None, seed: int = 0, eeprom: Eeprom | None = None) -> Rig:
    """The rig of a bench file, or of its text; without one, of a single module with bare motors.

    model: type of the first module; that of the bench, or 343, when None
    Raises `BenchError`; `ValueError` for another model.
    """
    if model not in {None, *MODELS}:
        raise WrongUseError(f"model is {', '.join(map(str, MODELS))}, not {model!r}")
    if bench is None:
        return simple_rig(model or 343, eeprom, seed=seed)
    from tmcm34x.bench.builder import build
    from tmcm34x.bench.description import parse, read, with_model

    text = isinstance(bench, str) and "\n" in bench
    description = parse(str(bench)) if text else read(bench)
    try:
        return build(with_model(description, model), () if eeprom is None else (eeprom,))
    except BenchError as error:
        raise BenchError(str(error) if text else f"{bench}: {error}") from None
