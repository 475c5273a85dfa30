"""Which lines of a TMCL source were executed, which way its conditional jumps went, and what took the time.

Coverage is written as an lcov tracefile, which other tools read and add up, and as an HTML page.  Counts of an
earlier run that a tracefile holds are added to those of this one, for lines that still hold a command.

lcov's records: SF file, DA line,count, BRDA line,block,branch,count (branch 0: jumped, 1: went on), end_of_record.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Set
from html import escape
from typing import TYPE_CHECKING, Final, NamedTuple

from tmcm34x.clock import HZ
from tmcm34x.tmcl.commands import BY_MNEMONIC

if TYPE_CHECKING:
    from tmcm34x.firmware.program import AddressCounts
    from tmcm34x.toolchain.assembler import Assembly

_JC: Final = BY_MNEMONIC["JC"].number
_CSUB: Final = BY_MNEMONIC["CSUB"].number
MAIN: Final = "(main program)"

Line = tuple[str, int]
"""File and number of a source line."""


class CoverageError(ValueError):
    """A tracefile that cannot be added to; one line."""


class LineCounts(NamedTuple):
    """How often the command of a line was executed; of a JC also how often it jumped."""

    executed: int
    jumped: int | None = None

    def plus(self, other: LineCounts) -> LineCounts:
        """This and what another run counted at the same line."""
        jumped = None if self.jumped is None else self.jumped + (other.jumped or 0)
        return LineCounts(self.executed + other.executed, jumped)


Coverage = Mapping[Line, LineCounts]
_NONE: Final = LineCounts(0)


class Cost(NamedTuple):
    """What a line or a subroutine took: commands executed, and clocks with the time spent in WAIT."""

    name: str
    executed: int
    clocks: int


def coverage(assembly: Assembly, counts: AddressCounts) -> dict[Line, LineCounts]:
    """What was executed of a source, by line; the counting must be over."""
    return {
        (code.file, code.number): LineCounts(
            counts.executed[address],
            counts.jumped[address]
            if code.instruction is not None and code.instruction.number == _JC
            else None,
        )
        for address, code in enumerate(assembly.code)
        if not code.appended
    }


def added(coverage: Coverage, earlier: Coverage, left_out: Set[Line] = frozenset()) -> dict[Line, LineCounts]:
    """`coverage` with what an earlier run counted: at the same lines, and in files that are not part of this program.

    left_out: lines that count on another model (`#if`); their counts are kept
    """
    files = {file for file, _ in coverage}
    kept = {line: counts for line, counts in earlier.items() if line[0] not in files or line in left_out}
    return {**kept, **{line: counts.plus(earlier.get(line, _NONE)) for line, counts in coverage.items()}}


def summed(first: Coverage, second: Coverage) -> dict[Line, LineCounts]:
    """Two coverages as one, with the lines of both."""
    return {**first, **{line: counts.plus(first.get(line, _NONE)) for line, counts in second.items()}}


class Totals(NamedTuple):
    """Of one file: commands and how many were executed, ways of conditional jumps and how many were taken."""

    file: str
    commands: int
    executed: int
    branches: int
    taken: int


def totals(coverage: Coverage) -> list[Totals]:
    """What was executed of each file."""
    return [_totals(file, lines) for file, lines in _by_file(coverage)]


def _by_file(coverage: Coverage) -> Iterator[tuple[str, list[tuple[int, LineCounts]]]]:
    """Each file with its lines in order."""
    for file in dict.fromkeys(file for file, _ in coverage):
        yield file, sorted((number, counts) for (name, number), counts in coverage.items() if name == file)


def _totals(file: str, lines: list[tuple[int, LineCounts]]) -> Totals:
    ways = [count for number, counts in lines for _, _, count in _branches(number, counts)]
    executed = sum(counts.executed > 0 for _, counts in lines)
    return Totals(file, len(lines), executed, len(ways), sum(count not in {"-", "0"} for count in ways))


# lcov


def format_lcov(coverage: Coverage) -> str:
    """A tracefile."""
    return "".join(f"{record}\n" for record in _records(coverage))


def _records(coverage: Coverage) -> Iterator[str]:
    for file, lines in _by_file(coverage):
        total = _totals(file, lines)
        branches = (each for number, counts in lines for each in _branches(number, counts))
        yield "TN:"
        yield f"SF:{file}"
        yield from (f"BRDA:{number},0,{way},{count}" for number, way, count in branches)
        yield f"BRF:{total.branches}"
        yield f"BRH:{total.taken}"
        yield from (f"DA:{number},{counts.executed}" for number, counts in lines)
        yield f"LF:{total.commands}"
        yield f"LH:{total.executed}"
        yield "end_of_record"


def _branches(number: int, counts: LineCounts) -> Iterator[tuple[int, int, str]]:
    if counts.jumped is not None:
        for way, count in enumerate((counts.jumped, counts.executed - counts.jumped)):
            yield number, way, str(count) if counts.executed else "-"


def parse_lcov(text: str) -> dict[Line, LineCounts]:
    """What a tracefile counts; raises `CoverageError` for a text that is none."""
    executed: dict[Line, int] = {}
    jumped: dict[Line, int] = {}
    file = ""
    for row, record in enumerate(text.splitlines(), 1):
        key, _, rest = record.partition(":")
        try:
            if key == "SF":
                file = rest
            elif key == "DA":
                number, count = map(int, rest.split(",")[:2])
                executed[file, number] = count
            elif key == "BRDA":
                number, _, way, count = rest.split(",")
                if way == "0":
                    jumped[file, int(number)] = 0 if count == "-" else int(count)
            elif key not in {"TN", "BRF", "BRH", "LF", "LH", "end_of_record"}:
                raise ValueError
        except ValueError:
            raise CoverageError(f"line {row} is not of an lcov tracefile: {record[:60]!r}") from None
    return {line: LineCounts(count, jumped.get(line)) for line, count in executed.items()}


# Profile


def line_costs(assembly: Assembly, counts: AddressCounts, instruction_clocks: int) -> list[Cost]:
    """What each executed line took, the most expensive first."""
    costs = [
        Cost(
            f"{code.file}:{code.number}",
            counts.executed[address],
            _clocks(counts, address, instruction_clocks),
        )
        for address, code in enumerate(assembly.code)
        if counts.executed[address]
    ]
    return sorted(costs, key=_by_cost)


def subroutine_costs(assembly: Assembly, counts: AddressCounts, instruction_clocks: int) -> list[Cost]:
    """What each subroutine took, without those that it calls, the most expensive first.

    A command belongs to the last subroutine that begins at or before it, what stands before all to the main program.
    """
    names = {symbol.value: symbol.name for symbol in assembly.symbols.values() if symbol.kind == "label"}
    starts = {
        code.instruction.value
        for code in assembly.code
        if code.instruction is not None and code.instruction.number == _CSUB
    }
    sums: dict[str, Cost] = {}
    name = MAIN
    for address in range(len(assembly.code)):
        if address in starts:
            name = names.get(address, f"address {address}")
        executed, clocks = counts.executed[address], _clocks(counts, address, instruction_clocks)
        before = sums.get(name, Cost(name, 0, 0))
        sums[name] = Cost(name, before.executed + executed, before.clocks + clocks)
    return sorted(sums.values(), key=_by_cost)


def _clocks(counts: AddressCounts, address: int, instruction_clocks: int) -> int:
    return counts.executed[address] * instruction_clocks + counts.waited[address]


def _by_cost(cost: Cost) -> tuple[int, int]:
    return -cost.clocks, -cost.executed


def format_costs(costs: Iterable[Cost], total: int) -> str:
    """A table of costs; total: clocks that are 100 percent."""
    lines = ["   time s       %   commands"]
    lines += [
        f"{cost.clocks / HZ:9.4f}  {100 * cost.clocks / (total or 1):6.2f}  {cost.executed:9}  {cost.name}"
        for cost in costs
    ]
    return "\n".join(lines)


# HTML

_STYLE: Final = """
body { font: 15px/1.4 system-ui, sans-serif; margin: 2em; color-scheme: light dark }
table { border-collapse: collapse; font-family: ui-monospace, monospace; font-size: 13px }
td { padding: 0 .8em; white-space: pre } td.n { text-align: right; opacity: .7 }
tr.missed td { background: #d0404033 } tr.half td { background: #d0a00033 }
"""


def format_html(coverage: Coverage, sources: Mapping[str, list[str]]) -> str:
    """A page with every source line, how often it was executed, and which way its jumps never went.

    sources: the lines of each file; of a file that has none here, the numbers are shown
    """
    parts = [f"<!doctype html><meta charset='utf-8'><title>TMCL coverage</title><style>{_STYLE}</style>"]
    for file, counted in _by_file(coverage):
        lines, total = dict(counted), _totals(file, counted)
        parts.append(
            f"<h2>{escape(file)}</h2><p>{total.executed} of {total.commands} commands executed</p><table>"
        )
        texts = sources.get(file) or [""] * max(lines)
        parts += [_row(number, text, lines.get(number)) for number, text in enumerate(texts, 1)]
        parts.append("</table>")
    return "\n".join(parts) + "\n"


def _row(number: int, text: str, counts: LineCounts | None) -> str:
    kind, count, note = "", "", ""
    if counts is not None:
        note = _missing(counts)
        kind = "missed" if not counts.executed else "half" if note else ""
        count = str(counts.executed)
    cells = f"<td class='n'>{number}</td><td class='n'>{count}</td><td>{escape(text)}</td><td>{note}</td>"
    return f"<tr class='{kind}'>{cells}</tr>"


def _missing(counts: LineCounts) -> str:
    if counts.jumped is None or not counts.executed or 0 < counts.jumped < counts.executed:
        return ""
    return "always jumped" if counts.jumped else "never jumped"
