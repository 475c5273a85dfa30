"""Where a program can go: successors, calls, loops, without running it.

Every condition may turn out either way, and a call goes on after its CSUB if the subroutine can reach an
RSUB.  All answers take time in proportion to the program's length.

Source: manual 6.7.18 to 6.7.23.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from functools import cached_property

from tmcm34x.tmcl.commands import BY_MNEMONIC, STACK_DEPTH
from tmcm34x.tmcl.datagram import Instruction

JC, JA, CSUB, RSUB, STOP = (BY_MNEMONIC[name].number for name in ("JC", "JA", "CSUB", "RSUB", "STOP"))
JUMPS = frozenset((JC, JA, CSUB))

Edges = Sequence[Sequence[int]]


class Flow:
    """The control flow graph of a program.

    Nodes are addresses; the one after the last instruction, `end`, stands for running past the end.
    entries: where the program may be started
    """

    def __init__(self, program: Sequence[Instruction | None], entries: Sequence[int] = (0,)) -> None:
        self.program = program
        self.entries = entries
        self.end = len(program)
        self._numbers = [-1 if i is None else i.number for i in program]

    @cached_property
    def calls(self) -> dict[int, int]:
        """The target of each CSUB that stays inside the program, by its address."""
        return {
            address: instruction.value
            for address, instruction in enumerate(self.program)
            if instruction is not None and instruction.number == CSUB and 0 <= instruction.value < self.end
        }

    @cached_property
    def steps(self) -> Edges:
        """From each address, the next ones in the same subroutine."""
        steps: list[Sequence[int]] = []
        for address, following in enumerate(self._jumps):
            steps.append(following if self._comes_back(address, self._returning) else ())
        return [*steps, ()]

    @cached_property
    def edges(self) -> Edges:
        """The same, and from each CSUB into its subroutine."""
        calls = self.calls
        return [(*steps, calls[n]) if n in calls else steps for n, steps in enumerate(self.steps)]

    @cached_property
    def main(self) -> frozenset[int]:
        """The addresses that are executed with no call open."""
        return frozenset(_reach(self.steps, self.entries))

    @cached_property
    def reachable(self) -> frozenset[int]:
        """All addresses that are executed; `end` among them when the program can run past its end."""
        return frozenset(_reach(self.edges, self.entries))

    @cached_property
    def recursive(self) -> frozenset[int]:
        """The CSUBs that can be executed again before their subroutine is back."""
        place = self._place
        return frozenset(a for a, target in self.calls.items() if a in place and place[a] == place[target])

    @cached_property
    def depth(self) -> dict[int, int]:
        """The greatest number of calls that can be open at each reachable address, recursion left aside."""
        return self._depth(self.edges, self._components, of_recursion=0)

    @cached_property
    def looping(self) -> frozenset[int]:
        """The addresses that can be executed again and again: in a loop, or in a subroutine called from one."""
        loops = {
            address
            for component in self._components
            for address in component
            if len(component) > 1 or address in self.edges[address]
        }
        called = [self.calls[address] for address in loops if address in self.calls]
        return frozenset(loops | _reach(self.edges, called))

    @cached_property
    def loops(self) -> list[list[int]]:
        """The addresses of each loop: sets of addresses that lead to each other."""
        return [c for c in self._components if len(c) > 1 or c[0] in self.edges[c[0]]]

    @cached_property
    def _jumps(self) -> Edges:
        """The steps, with every call taken to come back."""
        jumps: list[tuple[int, ...]] = []
        for address, instruction in enumerate(self.program):
            number = self._numbers[address]
            target = (
                () if instruction is None or not 0 <= instruction.value <= self.end else (instruction.value,)
            )
            if number == JA:
                jumps.append(target)
            elif number == JC:
                jumps.append((address + 1, *target))
            else:
                jumps.append(() if number in (RSUB, STOP) else (address + 1,))
        return jumps

    @cached_property
    def _returning(self) -> set[int]:
        """The addresses from which an RSUB can be reached in the same subroutine."""
        before: list[list[int]] = [[] for _ in range(self.end + 1)]
        callers: dict[int, list[int]] = {}
        for address, following in enumerate(self._jumps):
            for target in following:
                before[target].append(address)
        for address, target in self.calls.items():
            callers.setdefault(target, []).append(address)
        returning: set[int] = set()
        todo = [address for address, number in enumerate(self._numbers) if number == RSUB]
        while todo:
            address = todo.pop()
            if address in returning:
                continue
            returning.add(address)
            todo += [a for a in before[address] if self._comes_back(a, returning)]
            todo += [a for a in callers.get(address, ()) if a + 1 in returning]
        return returning

    @cached_property
    def _overflowing(self) -> frozenset[int]:
        """The calls that may find the stack full, and are ignored then: as good as coming back."""
        calls = self.calls
        edges = [(*steps, calls[n]) if n in calls else steps for n, steps in enumerate(self._jumps)]
        groups = components([*edges, ()], range(self.end))
        depth = self._depth([*edges, ()], groups, of_recursion=STACK_DEPTH)
        return frozenset(address for address in calls if depth[address] >= STACK_DEPTH)

    def _depth(self, edges: Edges, groups: list[list[int]], of_recursion: int) -> dict[int, int]:
        """The greatest number of open calls at each address of `groups`, which are in order."""
        place = {address: number for number, component in enumerate(groups) for address in component}
        levels = [0] * len(groups)
        for number, component in enumerate(groups):
            if any(place[self.calls[address]] == number for address in component if address in self.calls):
                levels[number] = max(levels[number], of_recursion)
            for address in component:
                target = self.calls.get(address)
                for following in edges[address]:
                    other = place[following]
                    if other != number:
                        levels[other] = max(levels[other], levels[number] + (following == target))
        return {address: levels[number] for address, number in place.items()}

    def _comes_back(self, address: int, returning: set[int]) -> bool:
        """Whether the program can go on after an address that may be a call."""
        target = self.calls.get(address)
        return target is None or target in returning or address in self._overflowing

    @cached_property
    def _place(self) -> dict[int, int]:
        """The component of each reachable address."""
        return {address: n for n, component in enumerate(self._components) for address in component}

    @cached_property
    def _components(self) -> list[list[int]]:
        """The strongly connected components that can be reached, each before those that it leads to."""
        return components(self.edges, self.entries)


def _reach(edges: Edges, starts: Iterable[int]) -> set[int]:
    seen: set[int] = set()
    todo = list(starts)
    while todo:
        node = todo.pop()
        if node not in seen:
            seen.add(node)
            todo.extend(edges[node])
    return seen


def components(edges: Edges, starts: Iterable[int]) -> list[list[int]]:
    """The strongly connected components that can be reached from `starts`, each before those that it leads to."""
    search = _Components(edges)
    for start in starts:
        if start not in search.index:
            search.run(start)
    return search.found[::-1]


class _Components:
    """Tarjan's algorithm with a stack of its own: programs are longer than Python's is deep."""

    def __init__(self, edges: Edges) -> None:
        self.index: dict[int, int] = {}
        self.found: list[list[int]] = []
        self._edges = edges
        self._low: dict[int, int] = {}
        self._members: list[int] = []
        self._waiting: set[int] = set()
        self._path: list[tuple[int, Iterator[int]]] = []

    def run(self, start: int) -> None:
        """Find the components from one node on."""
        self._enter(start)
        while self._path:
            node, following = self._path[-1]
            if not self._descend(node, following):
                self._leave(node)

    def _enter(self, node: int) -> None:
        self.index[node] = self._low[node] = len(self.index)
        self._members.append(node)
        self._waiting.add(node)
        self._path.append((node, iter(self._edges[node])))

    def _descend(self, node: int, following: Iterator[int]) -> bool:
        """Enter the next node that was not seen yet; whether there is one."""
        for target in following:
            if target not in self.index:
                self._enter(target)
                return True
            if target in self._waiting:
                self._low[node] = min(self._low[node], self.index[target])
        return False

    def _leave(self, node: int) -> None:
        low = self._low[node]
        self._path.pop()
        if self._path:
            caller = self._path[-1][0]
            self._low[caller] = min(self._low[caller], low)
        if low == self.index[node]:
            self._close(node)

    def _close(self, node: int) -> None:
        """The members since `node` are a component."""
        component: list[int] = []
        while not component or component[-1] != node:
            component.append(self._members.pop())
            self._waiting.discard(component[-1])
        self.found.append(component)
