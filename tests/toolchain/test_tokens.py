"""Source text as lines and tokens."""

import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tmcm34x.toolchain.tokens import number_value, split_lines, tokenize

TEXT = st.text(st.sampled_from("aZ_09.$%+-*/^(),:=#;\"' \t\x00ä\ufeff\xa0eE"), max_size=30) | st.text(
    max_size=30
)


@given(TEXT)
@settings(max_examples=300)
def test_tokens_and_the_blanks_between_them_are_the_line(line):
    line = line.replace("\n", "")
    position = 0
    for token in tokenize(line):
        assert token.start >= position
        assert not line[position : token.start].strip(" \t\r\v\f\x1c\x1d\x1e\x1f\x85\xa0\ufeff")
        assert line[token.start : token.end] == token.text
        position = token.end
    assert not line[position:].strip(" \t\r\v\f\xa0\ufeff")


@pytest.mark.parametrize(
    ("line", "kinds"),
    [
        ("Loop: MVP ABS, $1f", "name operator name name operator number"),
        ("1.5 .5 2e3 %101 2.", "number number number number number"),
        ("0x10 %2 $ 1a 1.2.3 5e", "malformed malformed malformed malformed malformed malformed"),
        ("a//b", "name comment"),
        ("; 'x'", "stray stray name stray"),
        ("a\xa0\ufeff b", "name name"),
    ],
)
def test_words_have_their_kind(line, kinds):
    assert [token.kind for token in tokenize(line)] == kinds.split()


def test_lines_end_with_lf_cr_lf_or_cr_and_nothing_else():
    assert split_lines("a\r\nb\rc\nd\x0ce\u2028f") == ["a", "b", "c", "d\x0ce\u2028f"]
    assert split_lines("") == [""]


def test_numbers_of_any_length_have_a_value():
    assert number_value("$ff") == 255
    assert number_value("%" + "0" * 500 + "101") == 5
    assert number_value("$" + "f" * 100_000) == math.inf
    assert number_value("9" * 100_000) == math.inf
