"""Whatever the text: diagnostics, never an exception."""

import random
import time

import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from tmcm34x.tmcl.commands import PROGRAM_SIZE
from tmcm34x.toolchain.assembler import assemble
from tmcm34x.toolchain.diagnostics import render_all
from tmcm34x.toolchain.disassembler import disassemble
from tmcm34x.toolchain.encoding import EncodingError, decode, encode
from tmcm34x.toolchain.formatter import format_source
from tmcm34x.toolchain.linter import lint
from tmcm34x.toolchain.listing import listing, symbol_file
from toolchain.generators import SOURCES


def through_everything(text, include=None):
    """One text through all of the tool chain; what comes out is checked for its form."""
    assembly = assemble(text, "main.tmc", include or (lambda name, _from: (name, "Sub: RSUB // included")))
    found = (*assembly.diagnostics, *lint(assembly))
    report = render_all(found, assembly.sources)
    assert report.count("\n") == 3 * len(found)
    for item in found:
        file, line, column, end = item.location
        assert 1 <= line <= len(assembly.sources[file])
        assert 1 <= column <= end <= len(assembly.sources[file][line - 1]) + 2
        for fix in item.fixes:
            assert fix.title and fix.edits
    for line in report.splitlines():
        assert len(line) < 400
        assert line.isprintable()
    assert format_source(format_source(text)) == format_source(text)
    assert listing(assembly)
    assert symbol_file(assembly).count("\n") == len(assembly.symbols)
    if assembly.ok:
        assert len(assembly.program) == len(assembly.code) <= PROGRAM_SIZE
        assert assemble(disassemble(assembly.program)).program == assembly.program
    else:
        assert assembly.program == ()
    return assembly


@example("Start:.A")
@given(SOURCES)
@settings(max_examples=80)
def test_sources_by_the_grammar(text):
    through_everything(text)


@given(SOURCES, st.randoms(use_true_random=False), st.integers(1, 8))
@settings(max_examples=80)
def test_sources_with_characters_lost_doubled_and_changed(text, chance: random.Random, count):
    for _ in range(count):
        place = chance.randrange(len(text) + 1)
        new = chance.choice(
            ["", ",", ":", "=", "(", ")", "//", "\n", "\r", "\0", "$", "%", "#", "é", "\ufeff", "9" * 40]
        )
        text = text[:place] + new + text[place + chance.randrange(3) :]
    through_everything(text)


@given(st.text(max_size=400))
@settings(max_examples=80)
def test_any_text(text):
    through_everything(text)


@given(st.binary(max_size=400))
@settings(max_examples=100)
def test_any_bytes(data):
    try:
        text, encoding = decode(data)
    except EncodingError:
        return
    assert encode(text, encoding) == data
    through_everything(text)


@given(st.lists(SOURCES, min_size=1, max_size=3), st.data())
@settings(max_examples=50)
def test_files_that_include_each_other(texts, data):
    names = [f"{n}.inc" for n in range(len(texts) + 1)]
    files = {
        name: f"#include {data.draw(st.sampled_from(names))}\n{text}\n#include {data.draw(st.sampled_from(names))}"
        for name, text in zip(names, texts, strict=False)
    }

    def include(name, _from):
        if name not in files:
            raise FileNotFoundError(2, "No such file or directory")
        return name, files[name]

    through_everything("#include 0.inc\nSTOP", include)


@pytest.mark.parametrize(
    "text",
    ["A" * 1_000_000, "(" * 100_000, "COMP " + "1+" * 50_000, "STOP" + " " * 1_000_000, "\0" * 1_000_000,
     "a:" * 50_000, "X = " + "-" * 100_000 + "1", "ROR " + "," * 100_000, "// " + "x" * 1_000_000,
     "COMP $" + "f" * 1_000_000, "9" * 1_000_000, "#" * 1_000_000, "#include " + "x" * 1_000_000, "/" * 999_999,
     "\n" * 100_000 + "foo", "foo\n" * 20_000, "X\n" * 20_000],
    ids=lambda text: f"{text[:8]!r}",
)  # fmt: skip
def test_huge_texts_take_no_great_time(text, ordinary_s):
    assert processing_s(text) < 30 * ordinary_s


@pytest.fixture(scope="module")
def ordinary_s():
    """Processor time of a program that fills the memory [s]: huge texts take four times as much at most."""
    return processing_s("\n".join(f"L{n}: MVP ABS, {n % 3}, {n} * 2 // move" for n in range(PROGRAM_SIZE)))


def processing_s(text):
    start = time.process_time()
    assembly = assemble(text, include=lambda name, _from: (name, ""))
    lint(assembly)
    render_all(assembly.diagnostics, assembly.sources)
    return time.process_time() - start
