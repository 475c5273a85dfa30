"""The program memory of a module and its stand-alone program, over the wire.

Source: manual 6.7.36; how hosts use it: fidelity PROG (download, upload, start).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Final, NamedTuple

from tmcm34x.host.connection import Connection
from tmcm34x.host.exceptions import VerifyError
from tmcm34x.tmcl.commands import PROGRAM_SIZE
from tmcm34x.tmcl.datagram import Instruction
from tmcm34x.tmcl.mnemonic import format_instruction

STOP: Final = 128
RUN: Final = 129
STEP: Final = 130
RESET: Final = 131
START_DOWNLOAD: Final = 132
QUIT_DOWNLOAD: Final = 133
_GGP: Final = 10
_STATUS, _COUNTER = 128, 130

END: Final = Instruction(0)
"""What stands behind a program, as the TMCL-IDE writes it: erased memory, or the IDE's own end mark."""

Progress = Callable[[int, int], None]
"""Told how many instructions of how many are done."""


class State(NamedTuple):
    """What the stand-alone program is doing."""

    status: int
    """0 stop, 1 run, 2 step, 3 reset (global parameter 128)."""
    counter: int
    """Address of the command being executed (global parameter 130)."""


def _ignore(done: int, total: int) -> None:
    """Progress that nobody watches."""


class Program:
    """The stand-alone program of the module at the other end of `connection`."""

    def __init__(self, connection: Connection) -> None:
        self._connection = connection

    def download(
        self,
        instructions: Sequence[Instruction],
        *,
        address: int = 0,
        verify: bool = True,
        progress: Progress = _ignore,
    ) -> None:
        """Store `instructions` from `address` on, with an end mark behind them, and read them back.

        Stops a running program.  Raises `VerifyError` at the first instruction that comes back differently.
        """
        room = PROGRAM_SIZE - address
        if not 0 < len(instructions) <= room:
            raise ValueError(f"{len(instructions)} instructions do not fit at address {address}")
        marked = [*instructions, END] if len(instructions) < room else list(instructions)
        total = len(marked) * (2 if verify else 1)
        self.stop()
        self._connection.command(START_DOWNLOAD, value=address)
        try:
            for done, instruction in enumerate(marked, 1):
                self._connection.execute(instruction)
                progress(done, total)
        finally:
            self._connection.command(QUIT_DOWNLOAD)
        if verify:
            for offset, instruction in enumerate(marked):
                self._verify(address + offset, instruction)
                progress(len(marked) + offset + 1, total)

    def upload(
        self, *, address: int = 0, size: int | None = None, progress: Progress = _ignore
    ) -> tuple[Instruction, ...]:
        """Read `size` instructions from `address` on; without a size, up to the end mark."""
        total = PROGRAM_SIZE - address if size is None else size
        instructions: list[Instruction] = []
        for offset in range(total):
            instruction = self._connection.read_instruction(address + offset)
            if size is None and instruction.number == END.number:
                break
            instructions.append(instruction)
            progress(offset + 1, total)
        return tuple(instructions)

    def run(self, address: int | None = None) -> None:
        """Start or continue the program, from `address` if one is given."""
        self._connection.command(RUN, 0 if address is None else 1, 0, address or 0)

    def restart(self) -> None:
        """Start the program from its beginning."""
        self.reset()
        self.run()

    def stop(self) -> None:
        """Stop the program; `run` continues it."""
        self._connection.command(STOP)

    def step(self) -> None:
        """Execute one command."""
        self._connection.command(STEP)

    def reset(self) -> None:
        """Stop the program and go back to its start."""
        self._connection.command(RESET)

    @property
    def state(self) -> State:
        """What the program is doing, and where."""
        return State(self._connection.command(_GGP, _STATUS), self._connection.command(_GGP, _COUNTER))

    def _verify(self, address: int, expected: Instruction) -> None:
        found = self._connection.read_instruction(address)
        if found != expected:
            raise VerifyError(
                f"address {address}: {format_instruction(found)} instead of {format_instruction(expected)}"
            )
