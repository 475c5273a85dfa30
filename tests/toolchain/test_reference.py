"""The reference pages: fresh, and their programs right."""

import re
from pathlib import Path

import pytest

from tmcm34x.tmcl.commands import COMMANDS
from tmcm34x.toolchain.assembler import assemble
from tmcm34x.toolchain.formatter import format_source
from tmcm34x.toolchain.linter import RULES, lint
from tmcm34x.toolchain.reference import TABLES, fill, word_meaning

DOCS = Path(__file__).parents[2] / "docs"
PAGES = ("language.md", "lint.md")
EXAMPLES = [
    pytest.param(text, id=f"{page}-{number}")
    for page in PAGES
    for number, text in enumerate(re.findall(r"```tmcl\n(.*?)```", (DOCS / page).read_text(), re.DOTALL))
]


@pytest.mark.parametrize("page", PAGES)
def test_the_tables_of_a_page_are_fresh(page):
    text = (DOCS / page).read_text()
    assert fill(text) == text


def test_every_table_stands_on_a_page():
    text = "".join((DOCS / page).read_text() for page in PAGES)
    assert set(re.findall(r"<!-- table: (\w+) -->", text)) == set(TABLES)


@pytest.mark.parametrize("text", EXAMPLES)
def test_an_example_assembles_without_findings_and_stands_in_columns(text):
    assembly = assemble(text)
    assert assembly.ok, assembly.diagnostics
    assert [item for item in lint(assembly) if item.severity != "information"] == []
    assert format_source(text) == text


def test_every_rule_and_every_command_is_explained():
    assert all(code in (DOCS / "lint.md").read_text() for code in RULES)
    text = (DOCS / "language.md").read_text()
    assert all(f"`{row.mnemonic}" in text for row in COMMANDS if row.number < 64)


def test_words_have_meanings_where_their_names_do_not_tell():
    for row in COMMANDS:
        for operand in row.operands:
            if operand.kind == "word" and row.mnemonic in ("JC", "WAIT", "CALC"):
                assert all(word_meaning(row.mnemonic, word) for word, _ in operand.words)
