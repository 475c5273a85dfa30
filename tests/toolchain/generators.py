"""Random TMCL sources, mostly right: by the grammar, from the command table."""

from hypothesis import strategies as st

from tmcm34x.tmcl.commands import COMMANDS
from tmcm34x.toolchain.expressions import FUNCTIONS

BLANK = st.sampled_from(["", " ", "  ", "\t"])
SPACE = st.sampled_from([" ", "  ", "\t", " \t "])
LABELS = ("Start", "Loop", "Sub_1", "a_rather_long_label_name", "Wait", "_x")
CONSTANTS = ("Speed", "Max_Pos", "n", "Sin", "POS", "STOPS")
COMMENT = st.sampled_from(["", "", "// note", "//note  ", "//! DATA", "// lint: ignore", "//", "// ä\x00"])


def anycase(text):
    return st.sampled_from([text, text.lower(), text.upper(), text.title()])


@st.composite
def expressions(draw, depth=2):
    kind = draw(st.integers(0, 6 if depth else 2))
    blank = draw(BLANK)
    if kind == 0:
        return draw(st.sampled_from(["0", "1", "42", "$2a", "$FF", "%101", "1.5", "2e1", ".5", "007"]))
    if kind == 1:
        return draw(st.sampled_from(CONSTANTS).flatmap(anycase))
    if kind == 2:
        return draw(st.sampled_from(["-1", "+ 3", "- $10", "--2"]))
    if kind == 3:
        return f"({blank}{draw(expressions(depth - 1))}{blank})"
    if kind == 4:
        return f"{draw(st.sampled_from(list(FUNCTIONS)).flatmap(anycase))}{blank}({draw(expressions(depth - 1))})"
    operator = draw(st.sampled_from("+-*/^"))
    return f"{draw(expressions(depth - 1))}{blank}{operator}{draw(BLANK)}{draw(expressions(depth - 1))}"


@st.composite
def operand_texts(draw, operand):
    if operand.kind == "word":
        return draw(st.sampled_from([word for word, _ in operand.words]).flatmap(anycase))
    if operand.kind == "address":
        return draw(st.sampled_from(LABELS).flatmap(anycase) | st.sampled_from(["0", "7", "2047"]))
    return draw(st.sampled_from(["0", "1", "2"]) | expressions())


@st.composite
def commands(draw):
    row = draw(st.sampled_from(COMMANDS))
    operands = [draw(operand_texts(operand)) for operand in row.operands]
    operands += ["1"] * draw(st.integers(0, max(0, len(row.spare) - 1)))
    comma = f"{draw(BLANK)},{draw(BLANK)}"
    return f"{draw(anycase(row.mnemonic))}{draw(SPACE)}{comma.join(operands)}"


@st.composite
def lines(draw):
    label = draw(st.sampled_from(["", "", *(f"{name}{b}:" for name in LABELS for b in ("", " "))]))
    statement = draw(
        st.one_of(
            st.just(""),
            commands(),
            commands(),
            commands(),
            st.builds(lambda n, b, e: f"{n}{b}={b}{e}", st.sampled_from(CONSTANTS), BLANK, expressions()),
            st.sampled_from(["#include a.inc", "//! DATA 37, 1,2 ,300", "//!data $10,0,0,-5 // old"]),
            st.text("ABCxyz019 ,:=()+-*/^$%#;\t\"'_.äß\x00\r\ufeff", max_size=20),
        )
    )
    return f"{draw(BLANK)}{label}{draw(BLANK)}{statement}{draw(BLANK)}{draw(COMMENT)}"


SOURCES = st.builds(
    lambda parts, newline, last: newline.join(parts) + last,
    st.lists(lines(), max_size=12),
    st.sampled_from(["\n", "\n", "\r\n", "\r"]),
    st.sampled_from(["", "\n", "\n\n"]),
)
