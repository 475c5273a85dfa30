"""Source text to instructions, with everything that an editor, a listing or a debugger needs.

Two passes: the first walks the lines and the files they include, gives addresses to instructions and values
to names; the second fills the instructions in.  Both go on after mistakes, so `Assembly.diagnostics` has all
of them.  Files are read by the caller's `include` function alone.

What a line means comes from the rows of `tmcl.commands`: operands, words, fields, spare fields.  Whatever the
eight bytes of an instruction can hold assembles; what the module will refuse is for the linter.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Final

from tmcm34x.tmcl.commands import BY_MNEMONIC, PROGRAM_SIZE
from tmcm34x.tmcl.datagram import Instruction
from tmcm34x.toolchain.assembly import Assembly, Code, Symbol
from tmcm34x.toolchain.diagnostics import Diagnostic
from tmcm34x.toolchain.first_pass import INCLUDE_DEPTH, FirstPass, IncludeReader
from tmcm34x.toolchain.messages import Messages
from tmcm34x.toolchain.names import Names
from tmcm34x.toolchain.parser import SourceLine, parse_line
from tmcm34x.toolchain.second_pass import SecondPass

__all__ = ["INCLUDE_DEPTH", "Assembly", "Code", "IncludeReader", "Symbol", "assemble", "no_includes"]


def no_includes(name: str, _from: str) -> tuple[str, str]:
    """The `include` function of a text that stands alone."""
    raise FileNotFoundError(f"no include files here: {name}")


def assemble(
    text: str,
    file_name: str = "program.tmc",
    include: IncludeReader = no_includes,
    *,
    append_stop: bool = False,
    parse: Callable[[str], SourceLine] = parse_line,
    model: int = 343,
) -> Assembly:
    """The program in `text`.

    file_name: how diagnostics and the source map call it; the `include` function gets it too
    append_stop: puts a STOP at the end unless the last instruction is one, as the TMCL-IDE does (fidelity TOOL-13)
    parse: `parse_line`, or one that remembers the lines it has seen
    model: the module that it is for, which `#if MODEL == 342` asks
    """
    messages = Messages()
    names = Names(messages)
    first = FirstPass(messages, names, include, parse, model)
    first.walk(file_name, text)
    code = list(map(SecondPass(messages, names).encode, first.pending))
    if append_stop and code and code[-1].row is not _STOP and len(code) < PROGRAM_SIZE:
        last = len(messages.sources[file_name])
        code.append(Code(_STOP, Instruction(_STOP.number), file_name, last, parse("")))
    if len(code) > PROGRAM_SIZE:
        text = f"the program has {len(code)} instructions; the memory takes {PROGRAM_SIZE}"
        messages.add(Diagnostic(code[PROGRAM_SIZE].location, "error", "E601", text))
    return Assembly(
        file_name, tuple(code), names.symbols, messages.result(), messages.sources, first.lines, first.includes,
        first.left_out,
    )  # fmt: skip


_STOP: Final = BY_MNEMONIC["STOP"]
