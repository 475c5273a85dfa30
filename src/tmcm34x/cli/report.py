"""What `tmcm34x run` prints at its end: what the program did, for people and as JSON."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from tmcm34x.bench.counters import Counters
from tmcm34x.bench.run import ENDINGS, TURNING, MotorAt, Run
from tmcm34x.chips.tmc423 import Tmc423
from tmcm34x.clock import NEVER, seconds
from tmcm34x.firmware.axis import X_ACTUAL, X_TARGET
from tmcm34x.tmcl.commands import BY_MNEMONIC, PROGRAM_SIZE, WAIT_TYPES
from tmcm34x.tmcl.mnemonic import format_instruction
from tmcm34x.tmcl.status import STATUS_TEXTS
from tmcm34x.toolchain.linter.settings import needy_parameters

if TYPE_CHECKING:
    from tmcm34x.firmware.program import ProgramError
    from tmcm34x.toolchain.assembler import Assembly
    from tmcm34x.trace.figures import FiguresRecorder, MotorFigures

_WAITS: Final = {
    dict(WAIT_TYPES)[word]: text
    for word, text in {
        "TICKS": "for its time",
        "POS": "for motor {motor} to reach its target: it is at {position}, the target is {target}",
        "REFSW": "for the left switch of motor {motor}",
        "LIMSW": "for a switch of motor {motor}",
        "RFS": "for the reference search of motor {motor}",
    }.items()
}
_ASKING: Final = frozenset(row.number for row in BY_MNEMONIC.values() if "reads" in row.where)
_MOST_POLLED: Final = 3


class Report:
    """The result of a run of `file`.

    assembly: of the program, if it is source
    """

    def __init__(self, run: Run, figures: FiguresRecorder, file: Path, assembly: Assembly | None) -> None:
        self.wall_s = 0.0
        """Seconds that the run took."""
        self._run = run
        self._module = run.module
        self._figures = figures
        self._file = file
        self._assembly = assembly
        self._counters = Counters(run.rig)

    # For programs

    def summary(self) -> dict[str, Any]:
        """Everything, for JSON."""
        run, module = self._run, self._module
        refusals = [self._refusal(error, count) for error, count in run.refusals.items()]
        return {
            "ending": run.ending,
            "simulated_s": seconds(run.rig.now),
            "wall_s": round(self.wall_s, 6),
            "instructions": module.program.executed,
            "program": self._standing(),
            "motors": [motor._asdict() for motor in self._figures.figures()],
            "turning": [motor._asdict() for motor in run.turning()],
            "variables": {str(n): value for n, value in enumerate(module.program.variables) if value},
            "outputs": module.board.outputs,
            "outputs_switched": self._figures.switched[0],
            "error": refusals[0] if refusals else None,
            "refusals": refusals,
            "absent": list(self._absent()),
            "counters": self._counters.figures(),
        }

    def _refusal(self, error: ProgramError, count: int) -> dict[str, Any]:
        return {
            "address": error.address,
            "status": int(error.status),
            "place": self._error_place(error),
            "text": self._error_text(error),
            "count": count,
        }

    def _standing(self) -> dict[str, Any]:
        program = self._module.program
        return {
            "state": program.state.name.lower(),
            "address": program.counter,
            "place": self.place(program.counter),
            "text": self.standing(),
        }

    # For people

    def __str__(self) -> str:
        run, module = self._run, self._module
        now = seconds(run.rig.now)
        rows = [("ended", self._ending()), ("simulated", f"{now:.6f} s{self._rate(now)}")]
        rows.append(("executed", f"{module.program.executed} instructions"))
        if module.program.active:
            rows.append(("program", self.standing()))
        rows += [(self._name(motor), _motor_text(motor)) for motor in self._figures.figures() if _told(motor)]
        variables = {n: value for n, value in enumerate(module.program.variables) if value}
        if variables:
            rows.append(("variables", ", ".join(f"{n} = {value}" for n, value in variables.items())))
        if any(self._figures.switched[0]) or module.board.outputs:
            rows.append(("outputs", self._outputs()))
        rows += [
            ("error", f"{self._error_place(error)}: {self._error_text(error)}{_times(count)}")
            for error, count in run.refusals.items()
        ]
        rows += [("absent", text) for text in self._absent()]
        rows += [("counted", text) for text in self._counted()]
        return "\n".join(f"{name:<11} {text}" for name, text in rows)

    def _ending(self) -> str:
        if self._run.ending != TURNING:
            return ENDINGS[self._run.ending]
        motors = self._run.turning()
        names = " and ".join(self._motor(motor) for motor in motors)
        return f"{names} keep{'s' if len(motors) == 1 else ''} turning, and nothing else can change any more"

    def _rate(self, now: float) -> str:
        return (
            f" in {self.wall_s:.2f} s, {now / self.wall_s:.0f} times real time" if self.wall_s > 0.005 else ""
        )

    def _name(self, motor: MotorFigures) -> str:
        return self._motor(MotorAt(motor.module, motor.motor))

    def _motor(self, motor: MotorAt) -> str:
        several = len(self._run.rig.modules) > 1
        return f"motor {motor.module}.{motor.motor}" if several else f"motor {motor.motor}"

    def _outputs(self) -> str:
        switched = [
            f"OUT_{n} switched {count} times" if count > 1 else f"OUT_{n} switched once"
            for n, count in enumerate(self._figures.switched[0])
            if count
        ]
        return "; ".join([f"{self._module.board.outputs:08b}", *switched])

    def _counted(self) -> list[str]:
        counted = self._counters.modules
        prefix = "module {}: " if len(counted) > 1 else ""
        return [
            prefix.format(number) + note for number, module in enumerate(counted) for note in module.notes()
        ]

    def _absent(self) -> Iterator[str]:
        """Parameters of the program that need hardware which the bench does not have."""
        module = self._module
        select = module.encoder_interface
        if select and isinstance(module.board.spi_device(select - 1), Tmc423):
            return
        program = [(address, module.program.memory[address]) for address in range(PROGRAM_SIZE)]
        for address, row in needy_parameters(program).items():
            text = f"the {row.name} needs {row.needs}, which the bench does not have"
            yield f"{self.place(address)}: {self._command(address)}: {text}"

    # Where things are

    def place(self, address: int) -> str:
        """Where a command stands: file and line where known."""
        places = () if self._assembly is None else self._assembly.source_map
        if address < len(places):
            return f"{places[address].file}:{places[address].line}"
        return f"{self._file}: address {address}"

    def standing(self) -> str:
        """Where the program is now, and what it waits for."""
        program = self._module.program
        here = f"{self.place(program.counter)}: {self._command(program.counter)}"
        if not program.active:
            return f"stopped at {self.place(program.counter)}"
        if program.wait is not None:
            return f"waits at {here}, {self._awaited()}"
        return self._polled() or f"runs at {here}"

    def _awaited(self) -> str:
        wait, module = self._module.program.wait, self._module
        assert wait is not None
        axis = module.axes[wait.motor if wait.motor < len(module.axes) else 0]
        text = _WAITS[wait.kind].format(
            motor=wait.motor, position=axis.read(X_ACTUAL), target=axis.read(X_TARGET)
        )
        return text if wait.limit >= NEVER else f"{text}, until {seconds(wait.limit):.3f} s"

    def _polled(self) -> str:
        """What a program that goes round in a cycle asks for again and again; empty while it is in none."""
        addresses = sorted(set(self._module.program.round()))
        if not addresses:
            return ""
        reads = [a for a in addresses if self._module.program.memory[a].number in _ASKING]
        asked = ", ".join(self._command(address) for address in reads[:_MOST_POLLED])
        where = f"goes round at {self.place(addresses[0])} to {self.place(addresses[-1])}"
        return f"{where}, asking for {asked}" if asked else where

    def _command(self, address: int) -> str:
        return format_instruction(self._module.program.memory[address])

    def _error_place(self, error: ProgramError) -> str:
        """Where a command was refused; after the last command, where that one is."""
        behind = self._module.program.memory[error.address].number == 0
        return self.place(max(error.address - 1, 0) if behind else error.address)

    def _error_text(self, error: ProgramError) -> str:
        if self._module.program.memory[error.address].number == 0:
            return "the program ran past its end; is a STOP missing?"
        return f"{self._command(error.address)}: {STATUS_TEXTS[error.status]} (status {error.status:d})"


def _times(count: int) -> str:
    return f", {count} times" if count > 1 else ""


def _told(motor: MotorFigures) -> bool:
    return bool(motor.distance or motor.position or motor.module == 0)


def _motor_text(motor: MotorFigures) -> str:
    lost = f", {abs(motor.lost)} full steps lost" if motor.lost else ""
    return f"distance {motor.distance}, peak speed {motor.peak_speed}, position {motor.position}{lost}"
