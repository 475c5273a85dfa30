"""Constant expressions."""

import math
import re

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tmcm34x.toolchain.expressions import FUNCTIONS, SourceExpressionError, compile_expression, evaluate
from tmcm34x.toolchain.tokens import tokenize

NAMES = {"X": 3.0, "Y": 0.5}


def value(text):
    return evaluate(compile_expression(tokenize(text)), lambda token: NAMES[token.text.upper()])


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("1+2*3", 7), ("(1+2)*3", 9), ("7-2-1", 4), ("8/4/2", 1), ("1/2", 0.5), ("2^3^2", 512), ("-2^2", -4),
        ("2^-1", 0.5), ("2^-1*4", 2), ("2*-3", -6), ("--3", 3), ("+3", 3), ("-(1-3)", 2), ("1 - -1", 2),
        ("$10+%11", 19), ("x*Y", 1.5), ("-x", -3), ("sqrt(16)^2", 16), ("SIN(0)-1", -1), ("2*(3+(4-1))", 12),
        ("abs(-(2))", 2), ("-5", -5),
    ],
)  # fmt: skip
def test_operators_have_the_precedence_of_mathematics(text, expected):
    assert value(text) == expected


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("SIN(RAD(30))", 0.5), ("COS(0)", 1), ("TAN(ATAN(2))", 2), ("ASIN(1)", math.pi / 2),
        ("ACOS(1)", 0), ("LOG(1000)", 3), ("LN(EXP(2))", 2), ("SQRT(2)^2", 2), ("ABS(-4.5)", 4.5), ("INT(-4.7)", -4),
        ("INT(4.7)", 4), ("ROUND(2.5)", 2), ("ROUND(3.5)", 4), ("ROUND(-1.2)", -1), ("SIGN(-7)", -1), ("SIGN(0)", 0),
        ("SIGN(0.1)", 1), ("DEG(ACOS(-1))", 180), ("RAD(180)", math.pi),
    ],
)  # fmt: skip
def test_functions_compute_what_they_say(text, expected):
    assert value(text) == pytest.approx(expected)
    assert value(text.lower()) == value(text)


def test_there_are_sixteen_functions():
    assert len(FUNCTIONS) == 16


@pytest.mark.parametrize(
    "text",
    ["1 2", "1+", "*1", "(1", "1)", "()", "SIN", "SIN(", "SIN()", "FOO(1)", "1,2", "a:b", "1/0", "SQRT(-1)", "LN(0)",
     "10^400", "(-8)^0.5", "0^-1", "ASIN(2)", "INT(1e999)", "EXP(1000)"],
)  # fmt: skip
def test_what_has_no_value_is_told(text):
    if text == "SIN":
        with pytest.raises(KeyError):
            value(text)
        return
    with pytest.raises(SourceExpressionError) as caught:
        value(text)
    _, start, end, *_ = caught.value.problem
    assert 0 <= start < end <= len(text)


@given(st.recursive(
    st.integers(0, 20).map(str) | st.sampled_from(["X", "Y"]),
    lambda inner: st.builds("({})".format, inner) | st.builds("-{}".format, inner)
    | st.builds("{}{}{}".format, inner, st.sampled_from(["+", "-", "*", "/", "^"]), inner),
    max_leaves=8,
))  # fmt: skip
@settings(max_examples=200)
def test_expressions_agree_with_python(text):
    try:
        expected = eval(re.sub(r"(\d+)", r"\1.0", text.replace("^", "**")), {"X": 3.0, "Y": 0.5})
    except (ZeroDivisionError, OverflowError):
        expected = None
    if isinstance(expected, complex):
        expected = None
    try:
        result = value(text)
    except SourceExpressionError:
        result = None
    if expected is None or abs(expected) > 1e300:
        return
    assert result == pytest.approx(float(expected), rel=1e-9, abs=1e-300)


def test_thousands_of_parentheses_are_no_trouble():
    depth = 30_000
    assert value("(" * depth + "1" + ")" * depth) == 1
    assert value("-" * depth + "1") == 1
    assert value("1" + "^1" * depth) == 1
