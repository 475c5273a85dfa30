"""Listing and symbol file of an assembly, as text.

A listing has a line for each source line, included files in their place:

    address  image                    line  source
    0000     04 00 00 00 00 27 10 3b     1  Loop: MVP ABS, 0, 10000

A symbol file has a line for each name, with tabs between its columns (fidelity TOOL-11).
"""

from __future__ import annotations

from collections.abc import Iterator

from tmcm34x.tmcl.datagram import pack_record
from tmcm34x.toolchain.assembler import Assembly, Code
from tmcm34x.toolchain.parser import Include

_HEAD = "address  image                    line  source"


def listing(assembly: Assembly) -> str:
    """The source of `assembly` with addresses and bytes beside it."""
    codes: dict[tuple[str, int], tuple[int, Code]] = {}
    for address, code in enumerate(assembly.code):
        if code.appended:
            continue
        codes.setdefault((code.file, code.number), (address, code))
    lines = [_HEAD]
    for file, number in _source_lines(assembly, assembly.file, {assembly.file}):
        address, code = codes.get((file, number), (0, None))
        lines.append(_line(address, code, f"{number:>4}", assembly.sources[file][number - 1]))
    last = assembly.code[-1] if assembly.code else None
    if last is not None and last.appended:
        lines.append(
            _line(len(assembly.code) - 1, last, "", "STOP // appended: the program did not end with one")
        )
    return "".join(f"{line}\n" for line in lines)


def _line(address: int, code: Code | None, number: str, source: str) -> str:
    place = f"{address:04}" if code is not None else ""
    instruction = code.instruction if code is not None else None
    image = pack_record(instruction).hex(" ") if instruction is not None else ""
    return f"{place:<7}  {image:<23}  {number:>4}  {source}".rstrip()


def symbol_file(assembly: Assembly) -> str:
    """Labels with their addresses and constants with their values, in the order of definition."""
    lines = [
        f"{symbol.kind}\t{symbol.name}\t{symbol.value:.15g}\t{symbol.definition.file}:{symbol.definition.line}\n"
        for symbol in assembly.symbols.values()
    ]
    return "".join(lines)


def _source_lines(assembly: Assembly, file: str, seen: set[str]) -> Iterator[tuple[str, int]]:
    for number, line in enumerate(assembly.lines[file], 1):
        if number == len(assembly.lines[file]) and not assembly.sources[file][-1]:
            return
        yield file, number
        if isinstance(line.statement, Include):
            included = assembly.includes.get((file, number))
            if included is not None and included not in seen:
                seen.add(included)
                yield from _source_lines(assembly, included, seen)
