"""The state of a bench in a file: `tmcm34x run --save-state` and `--from-state`."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from tmcm34x.bench.snapshot import SnapshotError
from tmcm34x.cli import CliError
from tmcm34x.files import read_bytes

if TYPE_CHECKING:
    from tmcm34x.bench import Rig
    from tmcm34x.tmcl.datagram import Instruction


def write(path: Path, rig: Rig) -> None:
    """Write the state of `rig`."""
    try:
        path.write_bytes(rig.snapshot())
    except OSError as error:
        raise CliError(f"{path}: {error.strerror}") from None


def read(path: Path, rig: Rig, program: Sequence[Instruction], file: Path) -> None:
    """Bring `rig` to the state in a file, whose first module must hold `program`, read from `file`."""
    try:
        rig.restore(read_bytes(path))
    except OSError as error:
        raise CliError(f"{path}: {error.strerror}") from None
    except SnapshotError as error:
        raise CliError(f"{path}: {error}") from None
    memory = rig.modules[0].program.memory
    if any(memory[address] != instruction for address, instruction in enumerate(program)):
        raise CliError(
            f"{path}: the module holds another program than {file}; run the one that it was saved with"
        )
