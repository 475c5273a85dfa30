"""A page for each diagnostic, whose example gets it and whose cure does not."""

import pytest

from tmcm34x.toolchain.assembler import assemble
from tmcm34x.toolchain.diagnostics import ERRORS
from tmcm34x.toolchain.explanations import CODES, MISTAKES, page, title
from tmcm34x.toolchain.linter import RULES, lint


def chain(name, _from):
    """Files that include one another without end, and `program.tmc`, which includes itself."""
    if name == "missing.inc":
        raise FileNotFoundError(2, "no such file")
    if name == "TMCLParam.tmc":
        raise FileNotFoundError(2, "no such file")
    return name, f"#include x{name}"


def test_every_diagnostic_has_a_page():
    assert set(MISTAKES) == set(ERRORS)
    assert set(CODES) == set(ERRORS) | set(RULES)
    for code in CODES:
        assert title(code)
        assert page(code).count("```tmcl") == 2


@pytest.mark.parametrize("code", MISTAKES)
def test_the_example_of_an_error_has_it_alone_and_the_cure_has_nothing(code):
    row = MISTAKES[code]
    assert [item.code for item in assemble(row.example, include=chain).diagnostics] == [code]
    cured = assemble(row.cure, include=chain)
    assert cured.diagnostics == ()
    assert lint(cured) == ()
