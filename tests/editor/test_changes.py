"""Texts changed piece by piece."""

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tmcm34x.editor.changes import offset, replaced, width


@pytest.mark.parametrize(
    ("text", "place", "new", "units", "expected"),
    [
        ("a\nbc\nd", ((1, 1), (1, 2)), "X", "utf-16", "a\nbX\nd"),
        ("a\r\nbc\r\nd", ((0, 1), (1, 0)), "", "utf-16", "abc\r\nd"),
        ("a\rb\rc", ((2, 0), (2, 1)), "X", "utf-16", "a\rb\rX"),
        ("a\x0cb\u2028c\nd", ((1, 0), (1, 1)), "X", "utf-16", "a\x0cb\u2028c\nX"),
        ("\U0001d11e=1", ((0, 2), (0, 3)), "X", "utf-16", "\U0001d11eX1"),
        ("\U0001d11e=1", ((0, 4), (0, 5)), "X", "utf-8", "\U0001d11eX1"),
        ("\U0001d11e=1", ((0, 1), (0, 2)), "X", "utf-32", "\U0001d11eX1"),
        ("a", ((9, 9), (9, 9)), "X", "utf-16", "aX"),
        ("a\r", ((9, 9), (9, 9)), "X", "utf-16", "a\rX"),
        ("a\nb", ((0, 9), (0, 9)), "X", "utf-16", "aX\nb"),
        ("", ((0, 0), (0, 0)), "X", "utf-16", "X"),
    ],
)
def test_a_piece_is_replaced(text, place, new, units, expected):
    assert replaced(text, *place, new, units) == expected


@given(st.text("aä𝄞\r\n", max_size=30), st.data(), st.sampled_from(["utf-8", "utf-16", "utf-32"]))
@settings(max_examples=150)
def test_every_place_has_its_offset(text, data, units):
    place = data.draw(st.integers(0, len(text)))
    if text[place - 1 : place + 1] == "\r\n":
        return
    before = text[:place].replace("\r\n", "\n").replace("\r", "\n")
    line = before.count("\n")
    assert offset(text, line, width(before.rpartition("\n")[2], units), units) == place
