"""What pages ask about a program and its module without changing either.

The memory as text, the source of what is in it, differences, flow, coverage, chip registers, and why a motor does not
turn.  `METHODS` has a function for each of these calls.
"""

from __future__ import annotations

import asyncio
import math
from collections.abc import Awaitable, Callable, Iterator, Mapping, Sequence
from difflib import SequenceMatcher
from itertools import zip_longest
from typing import TYPE_CHECKING, Final, Literal

from msgspec.structs import replace

from tmcm34x.firmware.program import AddressCounts
from tmcm34x.ide import wire
from tmcm34x.ide.chosen import text_of
from tmcm34x.ide.registers import registers
from tmcm34x.ide.virtual import Virtual
from tmcm34x.tmcl.mnemonic import format_instruction

if TYPE_CHECKING:
    from tmcm34x.firmware.program import StandAloneProgram
    from tmcm34x.ide.hub import Hub
    from tmcm34x.ide.window import Window
    from tmcm34x.toolchain.assembler import Assembly
    from tmcm34x.toolchain.map import Routine
    from tmcm34x.trace.coverage import Coverage

_NONE: Final = -1
"""The number of a line that one of two texts does not have."""
MOST_LINES: Final = 20_000
"""Lines of a comparison; longer texts are refused."""


# The program in the module


async def _upload(hub: Hub, page: Window, call: wire.Upload) -> str:
    from tmcm34x.toolchain.disassembler import disassemble

    if hub.loading.busy:
        raise wire.RefusalError("busy", "A download is under way.")
    program = await hub.loading.read()
    return disassemble(program) if program else ""


async def _adopt(hub: Hub, page: Window, call: wire.Adopt) -> bool:
    """With the STOP that the assembler puts at the end, or without: other hosts' programs may end in a jump."""
    choices = {call.options.append_stop: call.options, False: replace(call.options, append_stop=False)}
    for options in choices.values():
        answer, assembly = await hub.build(call.path, call.texts, options)
        if hub.loading.busy or answer.listing is None:
            return False
        if await hub.loading.holds(assembly.program):
            await hub.adopt(answer.listing, assembly)
            return True
    return False


# Motion


async def _why(hub: Hub, page: Window, call: wire.Why) -> wire.Reasons:
    from tmcm34x.ide.reasons import explain

    if hub.loading.busy:
        raise wire.RefusalError("busy", "A download is under way.")
    return await explain(hub.target, call.motor)


# Flow


async def _read_map(hub: Hub, page: Window, call: wire.ReadMap) -> wire.FlowMap | None:
    _, assembly = await hub.build(call.path, call.texts, call.options, as_part=True)
    return await asyncio.to_thread(flow_map, assembly) if assembly.ok and assembly.code else None


def flow_map(assembly: Assembly) -> wire.FlowMap:
    """The map of an assembled program that has instructions."""
    from tmcm34x.toolchain.map import INSTRUCTION_MS, Map

    found = Map(assembly)
    labels = assembly.labels
    addresses = {name: address for name, address in labels.items() if address < len(assembly.code)}

    def routine(row: Routine) -> wire.RoutineShape:
        path = assembly.code[addresses.get(row.name, 0)].file
        longest = None if math.isinf(row.longest) else int(row.longest)
        ms = None if longest is None else longest * INSTRUCTION_MS
        return wire.RoutineShape(row.name, path, row.line, row.instructions, list(row.calls), longest, ms)

    return wire.FlowMap(
        path=assembly.file,
        instructions=len(assembly.code),
        stack=found.stack,
        routines=[routine(row) for row in found.routines],
        variables=[
            wire.VariableShape(number, _sites(assembly, number, writers), _sites(assembly, number, readers))
            for number, writers, readers in found.variables
        ],
        labels=[
            wire.LabelShape(name, assembly.code[address].file, assembly.code[address].number, address)
            for name, address in sorted(addresses.items(), key=lambda item: item[1])
        ],
    )


def _sites(assembly: Assembly, variable: int, lines: Sequence[int]) -> list[wire.Site]:
    """The lines, with their files, at which commands name a user variable."""
    return [
        wire.Site(code.file, code.number)
        for code in assembly.code
        if code.number in lines and code.instruction is not None and code.instruction.type == variable
    ]


# Coverage


async def _cover(hub: Hub, page: Window, call: wire.Cover) -> None:
    program = _virtual(hub).module.program
    if (program.counts is not None) != call.on:
        program.count(AddressCounts() if call.on else None)


async def _read_coverage(hub: Hub, page: Window, call: wire.ReadCoverage) -> list[wire.CoveredLine]:
    from tmcm34x.trace.coverage import coverage

    virtual = _virtual(hub)
    if virtual.module.program.counts is None or hub.assembly is None:
        return []
    virtual.server.catch_up()
    return _covered(coverage(hub.assembly, _complete(virtual.module.program)))


def _complete(program: StandAloneProgram) -> AddressCounts:
    """What has been counted until now: counts are complete when others take their place, which go on from them."""
    counts, others = program.counts, AddressCounts()
    assert counts is not None
    program.count(others)
    others.executed, others.jumped, others.waited = (
        list(counts.executed),
        list(counts.jumped),
        list(counts.waited),
    )
    return counts


async def _read_tracefile(hub: Hub, page: Window, call: wire.ReadTracefile) -> list[wire.CoveredLine]:
    from tmcm34x.trace.coverage import CoverageError, parse_lcov

    try:
        return _covered(parse_lcov(text_of(call.file)))
    except CoverageError as error:
        raise wire.RefusalError("text", f"This is no lcov tracefile: {error}.") from error


def _covered(found: Coverage) -> list[wire.CoveredLine]:
    return [
        wire.CoveredLine(path, line, counts.executed, counts.jumped) for (path, line), counts in found.items()
    ]


# Differences


async def _compare(hub: Hub, page: Window, call: wire.Compare) -> wire.Comparison:
    compare = _compare_with_disk if call.against == "disk" else _compare_with_module
    return await compare(hub, call)


async def _compare_with_disk(hub: Hub, call: wire.Compare) -> wire.Comparison:
    disk = await asyncio.to_thread(hub.workspace.read, call.path)
    screen = call.texts.get(call.path, disk.text)
    rows = await asyncio.to_thread(differences, disk.text.split("\n"), screen.split("\n"))
    return wire.Comparison(call.path, "on the disk", "on the screen", disk.text == screen, rows)


async def _compare_with_module(hub: Hub, call: wire.Compare) -> wire.Comparison:
    """Instruction by instruction; a text that is the module's program becomes the known one."""
    answer, assembly = await hub.build(call.path, call.texts, call.options)
    if answer.listing is None:
        raise wire.RefusalError(
            "errors", f"{call.path} has errors: only a program without any can be compared."
        )
    memory = await hub.loading.memory()
    ours, theirs = list(map(format_instruction, assembly.program)), list(map(format_instruction, memory))
    same = assembly.program == tuple(memory)
    if same and assembly.program:
        await hub.adopt(answer.listing, assembly)
    rows = await asyncio.to_thread(differences, theirs, ours, first=0)
    return wire.Comparison(call.path, "in the module", "assembled from the screen", same, rows)


def differences(left: Sequence[str], right: Sequence[str], *, first: int = 1) -> list[wire.DiffRow]:
    """Both texts side by side, line by line, numbered from `first`; -1 where a side has no line."""
    if max(len(left), len(right)) > MOST_LINES:
        raise wire.RefusalError("size", f"More than {MOST_LINES} lines are not compared.")
    return list(_rows(left, right, first))


def _rows(left: Sequence[str], right: Sequence[str], first: int) -> Iterator[wire.DiffRow]:
    for tag, start, end, begin, stop in SequenceMatcher(None, left, right, autojunk=False).get_opcodes():
        pairs = zip_longest(range(start, end), range(begin, stop), fillvalue=_NONE)
        for one, other in pairs:
            yield wire.DiffRow(_kind(tag, one, other), *_side(left, one, first), *_side(right, other, first))


def _kind(tag: str, one: int, other: int) -> Literal["same", "changed", "gone", "new"]:
    if tag == "equal":
        return "same"
    return "new" if one == _NONE else "gone" if other == _NONE else "changed"


def _side(lines: Sequence[str], at: int, first: int) -> tuple[int, str]:
    return (_NONE, "") if at == _NONE else (at + first, lines[at])


# Chips


async def _read_registers(hub: Hub, page: Window, call: wire.ReadRegisters) -> list[wire.RegisterShape]:
    virtual = _virtual(hub)
    virtual.server.catch_up()
    return registers(virtual.module.board)


def _virtual(hub: Hub) -> Virtual:
    if not isinstance(hub.target, Virtual):
        raise wire.RefusalError("real", "Not available on a real module.")
    return hub.target


METHODS: Final[Mapping[type[wire.Call], Callable[..., Awaitable[object]]]] = {
    wire.Upload: _upload,
    wire.Adopt: _adopt,
    wire.Why: _why,
    wire.ReadMap: _read_map,
    wire.Cover: _cover,
    wire.ReadCoverage: _read_coverage,
    wire.ReadTracefile: _read_tracefile,
    wire.Compare: _compare,
    wire.ReadRegisters: _read_registers,
}
"""By the type of the call."""
