"""Likely mistakes in programs that assemble: what the module will refuse, never reach or wear out.

`rules.RULES` is the table: code, severity, what it means and why it matters.  A comment `// lint: ignore W101` on a
line suppresses these findings there, `// lint: ignore` all of them; `// lint: off W101` does so in the whole
program.  Rules about the control flow wait until the text has no errors; those about single commands do
not.
"""

from __future__ import annotations

from tmcm34x.toolchain.assembler import Assembly
from tmcm34x.toolchain.diagnostics import Diagnostic
from tmcm34x.toolchain.flow import Flow
from tmcm34x.toolchain.linter.commands import check_commands
from tmcm34x.toolchain.linter.findings import Findings
from tmcm34x.toolchain.linter.program import check_flow, check_names, check_program
from tmcm34x.toolchain.linter.registers import check_registers
from tmcm34x.toolchain.linter.rules import DEFAULT, RULES, Rule, ignored_codes, switched
from tmcm34x.toolchain.linter.settings import check_settings

__all__ = ["DEFAULT", "RULES", "Rule", "ignored_codes", "lint"]


def lint(assembly: Assembly, *, model: int = 343, rules: frozenset[str] = DEFAULT) -> tuple[Diagnostic, ...]:
    """The findings about a program, in the order of its files and lines; those of `assemble` are not repeated.

    model: the module that it is for, 341, 342 or 343
    rules: those that are on; comments `// lint: on W206` and `// lint: off W203` of the program's file come on top
    """
    rules = switched(assembly.sources[assembly.file], rules)
    found = Findings(assembly, model, rules)
    check_commands(found)
    check_names(found)
    if assembly.ok and assembly.code:
        flow = Flow([code.instruction for code in assembly.code], found.entries)
        check_flow(found, flow)
        check_program(found, flow)
        check_registers(found, flow)
        check_settings(found, flow)
    found.finish()
    order = {name: index for index, name in enumerate(assembly.sources)}
    found.items.sort(key=lambda item: (order[item.location.file], *item.location[1:], item.code))
    return tuple(found.items)
