import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tmcm34x.debug.expressions import (
    ExpressionError,
    compile_expression,
    compile_message,
    compile_reference,
    split_assignment,
)


def read(name, indices):
    if name == "none":
        raise ExpressionError("no value named none")
    return {"x": 7, "gp": 100 + sum(indices)}[name]


def value(text):
    return int(compile_expression(text)(read))


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("1 + 2 * 3", 7),
        ("(1 + 2) * 3", 9),
        ("-7 / 2", -3),
        ("-7 % 2", -1),
        ("7%2", 1),
        ("7 % %10", 1),
        ("$ff & %1010", 10),
        ("12 & 4 == 4", 1),
        ("1 << 4 | 1", 17),
        ("!x", 0),
        ("!(x == 6) && x > 3", 1),
        ("not x == 6 and x > 3", 1),
        ("0 || 0", 0),
        ("1 or none", 1),
        ("0 && none", 0),
        ("gp[3]", 103),
        ("gp[x + 1][2]", 110),
        ("gp[gp[1] - 100]", 101),
        ("~0", -1),
        ("- -x", 7),
        ("1 - 2 - 3", -4),
    ],
)
def test_an_expression_has_its_value(text, expected):
    assert value(text) == expected


@pytest.mark.parametrize(
    "text",
    [
        "",
        "1 +",
        "(1",
        "1)",
        "gp[1",
        "1 2",
        "x x",
        "a.b",
        "2 ^ 3",
        "1 = 2",
        "§",
        "*3",
        "()",
        "x[",
        "$",
        "0x10",
        "(" * 300,
    ],
)
def test_what_is_no_expression_is_refused(text):
    with pytest.raises(ExpressionError):
        compile_expression(text)


@pytest.mark.parametrize("text", ["1 / 0", "1 % 0", "1 << 40", "1 >> -1", "none + 1"])
def test_an_expression_without_a_value_says_so(text):
    with pytest.raises(ExpressionError):
        value(text)


@settings(max_examples=300)
@given(st.text(alphabet="x12 $%&|!=<>()[]+-*/~gp", max_size=40))
def test_any_text_is_an_expression_or_refused(text):
    try:
        compile_expression(text)(read)
    except ExpressionError as error:
        assert "\n" not in str(error)
    except KeyError as error:
        assert error.args[0] not in {"x", "gp"}


def test_a_message_shows_values_and_what_has_none():
    message = compile_message("x is {x}, twice {2 * x}; {none}")
    assert message(read) == "x is 7, twice 14; <no value named none>"
    assert compile_message("plain")(read) == "plain"


def test_an_assignment_is_told_from_a_comparison():
    assert split_assignment("gp[1] = 2") == ("gp[1]", " 2")
    assert split_assignment("x=1") is None or split_assignment("x=1") == ("x", "1")
    for text in ("x == 1", "x >= 1", "x != 1", "x"):
        assert split_assignment(text) is None
    assert compile_reference("gp[1][2]").name == "gp"
    with pytest.raises(ExpressionError):
        compile_reference("3")
