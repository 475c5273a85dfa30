"""A disassembly with the names of an older source: labels, constants and comments where the code is the same.

What the image and the source have in common is found as the longest common runs of instructions, the targets of
jumps left aside.  There the operands stand as the source writes them, with its comments and the remarks above them;
elsewhere the disassembly is a plain one.  The text assembles to the image in any case.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from difflib import SequenceMatcher
from typing import Final

from tmcm34x.tmcl.datagram import Instruction
from tmcm34x.toolchain.assembler import Assembly, Code, assemble
from tmcm34x.toolchain.disassembler import disassemble, explanation, jump_labels, source_form
from tmcm34x.toolchain.flow import JUMPS
from tmcm34x.toolchain.parser import ConstantDefinition, WrittenCommand

_MNEMONIC_COLUMN: Final = 8


def disassemble_like(program: Sequence[Instruction], old: Assembly) -> str:
    """Source text for `program`, with what an assembled older source calls things."""
    text = "".join(f"{line}\n" for line in _Likeness(program, old).lines())
    again = assemble(text)
    return text if again.ok and again.program == tuple(program) else disassemble(program)


def _kind(instruction: Instruction | None) -> tuple[int, ...]:
    """What two instructions must have in common: all but the target of a jump."""
    if instruction is None:
        return ()
    return instruction[:3] if instruction.number in JUMPS else tuple(instruction)


class _Likeness:
    def __init__(self, program: Sequence[Instruction], old: Assembly) -> None:
        self.program = program
        self.old = old
        before, after = [_kind(code.instruction) for code in old.code], [_kind(i) for i in program]
        blocks = SequenceMatcher(None, before, after, autojunk=False).get_matching_blocks()
        self.same = {
            b + n: a + n for a, b, size in blocks for n in range(size) if not old.code[a + n].appended
        }
        """Addresses of the old code, by those of the new one."""
        self.labels = self.carried_labels()

    def carried_labels(self) -> dict[int, list[str]]:
        """The labels at each address: those of the source, and new ones where a jump needs one."""
        at: dict[int, list[str]] = {}
        for symbol in self.old.symbols.values():
            if symbol.kind == "label":
                at.setdefault(int(symbol.value), []).append(symbol.name)
        labels: dict[int, list[str]] = {new: list(at.get(old, ())) for new, old in self.same.items()}
        for address, made in jump_labels(self.program).items():
            if not labels.get(address):
                labels[address] = [self.free(made)]
        return labels

    def free(self, name: str) -> str:
        """`name`, or one like it that the source does not have."""
        while name.upper() in self.old.symbols:
            name += "_"
        return name

    def lines(self) -> Iterator[str]:
        """The text: constants first, then the instructions."""
        yield from self.constants()
        targets: Mapping[int, str] = {address: names[0] for address, names in self.labels.items() if names}
        for address, instruction in enumerate(self.program):
            code = self.old.code[self.same[address]] if address in self.same else None
            if code is not None:
                yield from self.remarks(code)
            names = self.labels.get(address, ())
            for name in names[:-1]:
                yield f"{name}:"
            label = f"{names[-1]}:" if names else ""
            yield f"{label:<{_MNEMONIC_COLUMN - 1}} {self.body(instruction, code, dict(targets))}"
        for name in self.labels.get(len(self.program), ()):
            yield f"{name}:"

    def constants(self) -> Iterator[str]:
        """The definitions of constants in all files of the source."""
        for file, lines in self.old.lines.items():
            for number, line in enumerate(lines, 1):
                if isinstance(line.statement, ConstantDefinition) and (file, number) not in self.old.left_out:
                    yield self.old.sources[file][number - 1].strip()

    def remarks(self, code: Code) -> list[str]:
        """The comments and blank lines directly above an instruction."""
        lines, texts = self.old.lines[code.file], self.old.sources[code.file]
        first = code.number - 1
        while first and lines[first - 1].statement is None and not lines[first - 1].labels:
            first -= 1
        return [text.rstrip() for text in texts[first : code.number - 1]]

    def body(self, instruction: Instruction, code: Code | None, targets: dict[int, str]) -> str:
        """One instruction, as the source writes it where the code is the same."""
        statement = None if code is None else code.line.statement
        if code is None or not isinstance(statement, WrittenCommand):
            remark = explanation(instruction)
            text = source_form(instruction, targets)
            return f"{text}  // {remark}" if remark else text
        source = self.old.sources[code.file][code.number - 1]
        text = source[statement.start : statement.end]
        if instruction.number in JUMPS or "." in text:
            text = source_form(instruction, targets)
        comment = "" if code.line.comment is None else "  " + source[code.line.comment :].rstrip()
        return text + comment
