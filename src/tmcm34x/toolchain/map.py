"""The flow of a program made visible: routines and whom they call, stack, times between WAITs, user variables.

The time between WAITs is that of the longest way without one: instructions times the time of one instruction, which
is an assumption (docs/fidelity.md).  A loop without a WAIT has no longest way.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from functools import cached_property
from typing import Final, NamedTuple

from tmcm34x.tmcl.commands import BY_MNEMONIC, PROGRAM_SIZE, STACK_DEPTH, USER_VARIABLES
from tmcm34x.toolchain.assembler import Assembly
from tmcm34x.toolchain.entries import entries
from tmcm34x.toolchain.flow import RSUB, STOP, Flow, components

INSTRUCTION_MS: Final = 0.1
_WAIT: Final = BY_MNEMONIC["WAIT"].number
_WRITES: Final = frozenset(BY_MNEMONIC[name].number for name in ("SGP", "AGP", "RSGP"))
_READS: Final = frozenset(BY_MNEMONIC[name].number for name in ("GGP", "STGP"))
_VARIABLES: Final = 2


class Routine(NamedTuple):
    """An entry point or subroutine.

    calls: the names of the routines that it calls itself
    longest: instructions of the longest way without a WAIT, infinite where a loop has none
    """

    name: str
    line: int
    instructions: int
    calls: tuple[str, ...]
    longest: float


_NONE: Final = -math.inf


class Ways(NamedTuple):
    """Instructions of the longest ways of a routine without a WAIT; minus infinity where there is none.

    before: from its begin to its first WAIT or its end
    through: from its begin to an RSUB
    after: from a WAIT in it to an RSUB, the WAIT left out
    longest: of all, also within the routine
    """

    before: float
    through: float
    after: float
    longest: float


_ENDLESS: Final = Ways(math.inf, math.inf, math.inf, math.inf)
_NO_CALL: Final = Ways(0.0, 0.0, _NONE, 0.0)


class Variable(NamedTuple):
    """A user variable, and the lines that write and read it."""

    number: int
    writers: tuple[int, ...]
    readers: tuple[int, ...]


class Map:
    """What there is to know about the flow of an assembled program."""

    def __init__(self, assembly: Assembly) -> None:
        self.assembly = assembly
        self.flow = Flow([code.instruction for code in assembly.code], entries(assembly))

    @cached_property
    def stack(self) -> int:
        """The greatest number of calls open at once; recursion left aside."""
        flow = self.flow
        return max(
            (flow.depth.get(address, 0) + 1 for address in flow.calls if address in flow.depth), default=0
        )

    @cached_property
    def routines(self) -> list[Routine]:
        """The entry points, then the subroutines, by address."""
        called = sorted(set(self.flow.calls.values()) - set(self.flow.entries))
        return [
            self._routine(address) for address in (*self.flow.entries, *called) if address < self.flow.end
        ]

    @cached_property
    def variables(self) -> list[Variable]:
        """The user variables that the program uses."""
        writers: dict[int, list[int]] = {}
        readers: dict[int, list[int]] = {}
        for code in self.assembly.code:
            instruction = code.instruction
            if (
                instruction is not None
                and instruction.motor == _VARIABLES
                and instruction.type < USER_VARIABLES
            ):
                for numbers, lines in ((_WRITES, writers), (_READS, readers)):
                    if instruction.number in numbers:
                        lines.setdefault(instruction.type, []).append(code.number)
        return [
            Variable(number, tuple(writers.get(number, ())), tuple(readers.get(number, ())))
            for number in sorted({*writers, *readers})
        ]

    def _name(self, address: int) -> str:
        labels = self._labels
        return labels.get(address, "start" if address == 0 else f"address {address}")

    @cached_property
    def _labels(self) -> Mapping[int, str]:
        return {address: name for name, address in reversed(self.assembly.labels.items())}

    def _routine(self, address: int) -> Routine:
        body = self._body(address)
        calls = sorted({self.flow.calls[n] for n in body if n in self.flow.calls})
        return Routine(
            self._name(address),
            self.assembly.code[address].number,
            len(body),
            tuple(self._name(target) for target in calls),
            self._ways[address].longest,
        )

    def _body(self, address: int) -> list[int]:
        """The addresses of a routine, without those of the routines that it calls."""
        seen: set[int] = set()
        waiting = [address]
        while waiting:
            node = waiting.pop()
            if node not in seen and node != self.flow.end:
                seen.add(node)
                waiting += self.flow.steps[node]
        return sorted(seen)

    @cached_property
    def _ways(self) -> dict[int, Ways]:
        """The ways without a WAIT through each routine, and through those that it calls."""
        graph: list[set[int]] = [set() for _ in range(self.flow.end + 1)]
        starts = {*self.flow.entries, *self.flow.calls.values()}
        for address in starts - {self.flow.end}:
            graph[address] = {self.flow.calls[n] for n in self._body(address) if n in self.flow.calls}
        ways: dict[int, Ways] = {}
        for group in reversed(components([tuple(calls) for calls in graph], starts)):
            for address in group:
                recursive = len(group) > 1 or address in graph[address]
                ways[address] = _ENDLESS if recursive else self._ways_through(address, ways)
        return ways

    def _ways_through(self, address: int, called: Mapping[int, Ways]) -> Ways:
        """The same of one routine; `called` has those that it calls."""
        body = self._body(address)
        calls = {n: called[self.flow.calls[n]] for n in body if self.flow.calls.get(n) in called}
        ahead, back = self._lengths(body, calls)
        resumed = {n: 0.0 for n in body if self._number(n) == _WAIT}
        resumed |= {n: ways.after for n, ways in calls.items()}
        following = [
            (begun, n) for node, begun in resumed.items() for n in self.flow.steps[node] if n != self.flow.end
        ]
        after = max((_sum(begun, back[n]) for begun, n in following), default=_NONE)
        inside = (ways.longest for ways in calls.values())
        longest = max([*ahead.values(), *inside, *(begun + ahead[n] for begun, n in following)])
        return Ways(ahead[address], back[address], after, longest)

    def _lengths(
        self, body: Sequence[int], calls: Mapping[int, Ways]
    ) -> tuple[dict[int, float], dict[int, float]]:
        """Instructions from each address of a routine to the next WAIT or the end, and to an RSUB without a WAIT."""
        ahead: dict[int, float] = {}
        back: dict[int, float] = {}
        for component in reversed(components(self._steps_without_wait(body, calls), body)):
            following = {n for node in component for n in self._next(node, calls)}
            further = max((ahead[n] for n in following - {*component}), default=0.0)
            return_ = max((back[n] for n in following - {*component}), default=_NONE)
            node = component[0]
            if len(component) > 1 or node in following:
                further, return_ = math.inf, math.inf if return_ > _NONE else _NONE
            elif self._number(node) == RSUB:
                return_ = 0.0
            for node in component:
                ways = calls.get(node, _NO_CALL)
                ahead[node] = 1.0 + max(ways.before, ways.through + further)
                back[node] = _sum(1.0 + ways.through, return_)
        return ahead, back

    def _number(self, address: int) -> int:
        instruction = self.flow.program[address]
        return -1 if instruction is None else instruction.number

    def _steps_without_wait(self, body: Iterable[int], calls: Mapping[int, Ways]) -> list[list[int]]:
        steps: list[list[int]] = [[] for _ in range(self.flow.end + 1)]
        for node in body:
            steps[node] = self._next(node, calls)
        return steps

    def _next(self, node: int, calls: Mapping[int, Ways]) -> list[int]:
        """Where the program goes after an address without a WAIT."""
        if self._number(node) in {-1, _WAIT, STOP} or calls.get(node, _NO_CALL).through == _NONE:
            return []
        return [n for n in self.flow.steps[node] if n != self.flow.end]


def _sum(*parts: float) -> float:
    """The length of a way in parts, none where one part has none."""
    return _NONE if _NONE in parts else sum(parts)


def program_map(assembly: Assembly) -> str:
    """The map of a program as text."""
    return "".join(f"{line}\n" for line in _lines(Map(assembly)))


def _lines(found: Map) -> Iterator[str]:
    count = len(found.assembly.code)
    stack = f"{found.stack} of {STACK_DEPTH} calls open at most"
    yield f"{found.assembly.file}: {count} of {PROGRAM_SIZE} instructions, {stack}"
    yield ""
    yield f"{'routine':<24} {'line':>5} {'instructions':>13}  {'between WAITs':<24} calls"
    for routine in found.routines:
        yield (
            f"{routine.name:<24} {routine.line:>5} {routine.instructions:>13}  {_time(routine.longest):<24} "
            f"{', '.join(routine.calls)}"
        ).rstrip()
    if found.variables:
        yield ""
        yield "variable  written in lines        read in lines"
    for number, writers, readers in found.variables:
        yield f"{number:>8}  {_numbers(writers):<23} {_numbers(readers)}".rstrip()


def _time(longest: float) -> str:
    if math.isinf(longest):
        return "a loop without a WAIT"
    return f"{longest:.0f}, {longest * INSTRUCTION_MS:.1f} ms"


def _numbers(lines: tuple[int, ...]) -> str:
    return ", ".join(map(str, lines)) or "-"
