"""`--user-functions FILE.py`: a customer's extension of the firmware, in Python.

The file defines any of `uf0` to `uf7`, each `ufN(module, type, motor, value)`; it is what the manual calls a
customer specific extension written in C (6.7.33). A function returns the value of the reply, or a pair of status
and value, or nothing, which echoes the value with status 100. `BANK_1`, a dictionary from numbers to values,
gives the global parameters of bank 1; functions find them in `module.user_parameters`.

The file is run as the program that it is: take only your own.

Source: manual 6.7.33, 8.2; fidelity FW-93.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Final, NamedTuple, cast

import click

from tmcm34x.cli import CliError
from tmcm34x.tmcl.commands import INT32_MAX, INT32_MIN
from tmcm34x.tmcl.datagram import signed32
from tmcm34x.tmcl.status import Status

if TYPE_CHECKING:
    from tmcm34x.firmware.module import FirmwareModule

FUNCTIONS: Final = 8
"""UF0 to UF7."""

option = click.option(
    "--user-functions",
    type=click.Path(path_type=Path),
    metavar="FILE.py",
    help="Python file that defines uf0 to uf7(module, type, motor, value), and BANK_1; it is run.",
)


def attach(path: Path, modules: Iterable[FirmwareModule], report: Callable[[str], None]) -> None:
    """Give `modules` the functions and the bank 1 that the file at `path` defines.

    report: called with one line when a function fails later; the module then answers status 6.
    Raises `CliError` when the file cannot be run or defines nothing of use.
    """
    names = _run(path)
    functions = {n: names[f"uf{n}"] for n in range(FUNCTIONS) if callable(names.get(f"uf{n}"))}
    parameters = _parameters(path, names.get("BANK_1", {}))
    if not functions and not parameters:
        raise CliError(f"{path}: defines none of uf0 to uf{FUNCTIONS - 1} and no BANK_1")
    for module in modules:
        module.user_parameters = dict(parameters)
        module.user_functions = {n: _Guarded(path, n, call, report) for n, call in functions.items()}


def _run(path: Path) -> dict[str, Any]:
    import runpy

    try:
        return runpy.run_path(str(path))
    except OSError as error:
        raise CliError(f"{path}: {error.strerror}") from None
    except Exception as error:
        raise CliError(f"{path}{_line(path, error)}: {_text(error)}") from None


def _parameters(path: Path, bank: Any) -> dict[int, int]:
    import msgspec

    number = Annotated[int, msgspec.Meta(ge=0, le=255)]
    value = Annotated[int, msgspec.Meta(ge=INT32_MIN, le=INT32_MAX)]
    try:
        return cast(dict[int, int], msgspec.convert(bank, type=dict[number, value]))
    except msgspec.ValidationError as error:
        raise CliError(
            f"{path}: BANK_1 is a dictionary from numbers 0 to 255 to whole numbers: {error}"
        ) from None


class _Guarded(NamedTuple):
    """A function of the file, whose failures are reported and answered with status 6."""

    path: Path
    n: int
    function: Callable[..., Any]
    report: Callable[[str], None]

    def __call__(self, module: FirmwareModule, type_: int, motor: int, value: int) -> tuple[int, int]:
        try:
            return _result(self.function(module, type_, motor, value), value)
        except Exception as error:
            self.report(f"{self.path}{_line(self.path, error)}: uf{self.n}: {_text(error)}")
            return Status.NOT_AVAILABLE, value


def _result(answer: Any, value: int) -> tuple[int, int]:
    """What a function gave back, as a status and a value that fit into a reply."""
    if answer is None:
        return Status.OK, value
    if isinstance(answer, tuple):
        status, answer = (int(part) for part in answer)  # pyright: ignore[reportUnknownVariableType, reportUnknownArgumentType]
        if not 0 <= status <= 255:
            raise ValueError(f"{status} is no status: a reply has 0 to 255")
        return status, signed32(answer)
    return Status.OK, signed32(int(answer))


def _line(path: Path, error: Exception) -> str:
    """`:LINE` of the file where the error arose, if it did there."""
    import traceback

    if isinstance(error, SyntaxError):
        return f":{error.lineno}"
    lines = [
        frame.lineno for frame in traceback.extract_tb(error.__traceback__) if frame.filename == str(path)
    ]
    return f":{lines[-1]}" if lines else ""


def _text(error: Exception) -> str:
    return f"{type(error).__name__}: {error}".splitlines()[0]
