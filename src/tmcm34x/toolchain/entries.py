"""Where a program may be entered: address 0, and what a host starts by *run application from address*.

Further entry points are declared by a comment `// tmcl: entry` on the line of an instruction or of its label, or
recognised as a jump table at the beginning of the program (fidelity TOOL-12):

    Home:   CSUB  Search            at most one call, then JA or STOP; two entries or more
            STOP
    Move:   JA    Go

Source: manual 6.7.36, function 129 with type 1.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import Final

from tmcm34x.toolchain.assembler import Assembly
from tmcm34x.toolchain.flow import CSUB, JA, STOP

_ENTRY: Final = re.compile(r"//\W*tmcl:\s*entry\b", re.IGNORECASE)


def entries(assembly: Assembly) -> tuple[int, ...]:
    """The addresses where the program may be started, in order; 0 is always one."""
    return tuple(sorted({0, *_declared(assembly), *_table(assembly)}))


def _declared(assembly: Assembly) -> Iterator[int]:
    marked = {
        (file, number)
        for file, texts in assembly.sources.items()
        for number, text in enumerate(texts, 1)
        if "tmcl" in text and _ENTRY.search(text)
    }
    if not marked:
        return
    for address, code in enumerate(assembly.code):
        if (code.file, code.number) in marked:
            yield address
    for symbol in assembly.symbols.values():
        place = symbol.definition
        if (
            symbol.kind == "label"
            and (place.file, place.line) in marked
            and symbol.value < len(assembly.code)
        ):
            yield int(symbol.value)


def _table(assembly: Assembly) -> list[int]:
    """The entries of a jump table at the beginning; none where there are fewer than two."""
    labelled = {symbol.value for symbol in assembly.symbols.values() if symbol.kind == "label"}
    numbers = [code.instruction.number if code.instruction is not None else -1 for code in assembly.code]
    found: list[int] = []
    address = 0
    while address < len(numbers) and (address in labelled or numbers[address] == JA or not found):
        end = address + (numbers[address] == CSUB)
        if end >= len(numbers) or numbers[end] not in (JA, STOP):
            break
        found.append(address)
        address = end + 1
    return found if len(found) > 1 else []
