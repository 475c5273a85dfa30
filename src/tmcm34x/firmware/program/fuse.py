"""A loop of register commands as one function, with the registers in local variables.

The commands around a starting address are cut into *blocks*, each executed as a whole: a block begins where a jump
leads, behind a jump, or after `LONGEST_BLOCK` commands.  The function goes from block to block by a binary
decision on the counter until fewer commands are left than a block may have.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator, Sequence
from typing import Final, cast

from tmcm34x.firmware.program.counts import AddressCounts
from tmcm34x.firmware.program.registers import NAMES, Registers
from tmcm34x.firmware.program.templates import (
    ENDS_BLOCK,
    JA,
    WITH_TARGET,
    compiled,
    conditional,
    counted,
    filled,
    statements,
)
from tmcm34x.tmcl.datagram import Instruction

LONGEST_BLOCK: Final = 32
"""Instructions of a fused block; a run with fewer left goes command by command."""
_LARGEST_REGION: Final = 512

Read = Callable[[int], Instruction]
"""The command at an address."""
Code = Callable[[int], "str | None"]
"""The template of the command at an address, None for a module command."""


def fuse(
    read: Read, code: Code, start: int, counts: AddressCounts | None
) -> tuple[Collection[int], Callable[[Registers, int], int]]:
    """The addresses at which blocks begin around `start`, and the function for all of them.

    counts: where the blocks count themselves, and the jumps of JC
    """
    blocks = _blocks(read, code, sorted(_region(read, code, start)), start, counts)
    if counts is None:
        return blocks, compiled("\n".join(_source(blocks)), "fused")
    inner = "\n".join(f"    {line}" for line in _source(blocks))
    return blocks, compiled(f"def make(marks):\n{inner}\n    return fused", "make")(counts.marks)


def _region(read: Read, code: Code, start: int) -> list[int]:
    """Addresses of register commands that execution can come to from `start`."""
    region: list[int] = []
    seen, open_ = {start}, [start]
    while open_ and len(region) < _LARGEST_REGION:
        address = open_.pop()
        if code(address) is None:
            continue
        region.append(address)
        following = [each for each in _successors(read, address) if each not in seen]
        seen.update(following)
        open_ += following
    return region


def _successors(read: Read, address: int) -> tuple[int, ...]:
    number, _, _, target = read(address)
    if number == JA:
        return (target,)
    return (address + 1, target) if number in WITH_TARGET else (address + 1,)


def _leaders(read: Read, region: Sequence[int], start: int) -> list[int]:
    """Addresses of `region` at which a block starts."""
    inside = set(region)
    leaders = {start}
    for address in region:
        number, _, _, target = read(address)
        if number in WITH_TARGET:
            leaders.add(target)
        if number in ENDS_BLOCK or address + 1 not in inside:
            leaders.add(address + 1)
        if address - 1 not in inside:
            leaders.add(address)
    return sorted((leaders | _cuts(region, leaders)) & inside)


def _cuts(region: Sequence[int], leaders: Collection[int]) -> set[int]:
    """Further leaders, so that no block is too long."""
    cuts: set[int] = set()
    length = 0
    for address in region:
        length = 1 if address in leaders else length + 1
        if length > LONGEST_BLOCK:
            cuts.add(address)
            length = 1
    return cuts


def _blocks(
    read: Read, code: Code, region: Sequence[int], start: int, counts: AddressCounts | None
) -> dict[int, list[str]]:
    """The source of every block of `region`, by its first address."""
    inside, leaders = set(region), _leaders(read, region, start)
    starts = set(leaders)
    blocks: dict[int, list[str]] = {}
    for leader in leaders:
        lines: list[str] = []
        address, ends, template = leader, False, ""
        while not ends:
            template = cast(str, code(address))
            lines += filled(_lines(template, address, counts), read(address), address)
            address += 1
            ends = template.startswith("counter") or address in starts or address not in inside
        if not template.startswith("counter"):
            lines.append(f"counter = {address}")
        if counts is not None:
            lines.insert(0, f"marks[{counts.mark(leader, address)}] += 1")
        blocks[leader] = [f"left -= {address - leader}", *lines]
    return blocks


def _lines(template: str, address: int, counts: AddressCounts | None) -> list[str]:
    if counts is None or not conditional(template):
        return statements(template)
    return counted(template, counts.jump(address))


def _source(blocks: dict[int, list[str]]) -> Iterator[str]:
    """A function that runs `blocks` with the registers in local variables."""
    registers = [name for name in NAMES if name not in {"stack", "variables"}]
    yield "def fused(registers, left):"
    for name in NAMES:
        yield f"    {name} = registers.{name}"
    yield f"    while left >= {LONGEST_BLOCK}:"
    yield from _choice(blocks, sorted(blocks), "        ")
    for name in registers:
        yield f"    registers.{name} = {name}"
    yield "    return left"


def _choice(blocks: dict[int, list[str]], leaders: Sequence[int], indent: str) -> Iterator[str]:
    """A binary decision for the block that starts at the counter."""
    if len(leaders) == 1:
        yield f"{indent}if counter != {leaders[0]}: break"
        yield from (indent + line for line in blocks[leaders[0]])
        return
    middle = len(leaders) // 2
    yield f"{indent}if counter < {leaders[middle]}:"
    yield from _choice(blocks, leaders[:middle], indent + "    ")
    yield f"{indent}else:"
    yield from _choice(blocks, leaders[middle:], indent + "    ")
