"""Source text in columns."""

import tempfile
from pathlib import Path

from click.testing import CliRunner
from hypothesis import example, given, settings
from hypothesis import strategies as st

from tmcm34x.cli import CliError
from tmcm34x.cli.fmt import command
from tmcm34x.tmcl.mnemonic import format_instruction, parse_instruction
from tmcm34x.toolchain.assembler import assemble
from tmcm34x.toolchain.encoding import Encoding, decode, encode
from tmcm34x.toolchain.formatter import format_source, lexical_mistake
from tmcm34x.toolchain.tokens import split_lines, tokenize
from toolchain.generators import SOURCES


def test_labels_mnemonics_operands_and_comments_stand_in_columns():
    text = (
        "// Demo\n#include   names.inc\nSpeed=500 // fast\nN = sin( rad( 90 ) )*2\n\n"
        "loop:mvp abs,0,Speed*-2//go\n   // between\nwait   Pos , 0,0     // there?\n"
        "                            // really\n JA loop\nlong_label_alone:\n//! data 37,1, 2,300\n"
    )
    assert format_source(text) == (
        "// Demo\n"
        "#include names.inc\n"
        "Speed = 500                       // fast\n"
        "N     = SIN(RAD(90)) * 2\n"
        "\n"
        "loop:   MVP   ABS, 0, Speed * -2  //go\n"
        "        // between\n"
        "        WAIT  POS, 0, 0           // there?\n"
        "                                  // really\n"
        "        JA    loop\n"
        "long_label_alone:\n"
        "        //! DATA 37, 1, 2, 300\n"
    )


def test_lines_that_are_not_understood_stay():
    text = "  sap  1,,2 // oops   \n  foo   1\n ; note\n"
    assert format_source(text) == "  sap  1,,2 // oops\n  foo   1\n ; note\n"


def test_line_ends_stay_and_the_last_line_gets_one():
    assert format_source("stop\r\nstop") == "        STOP\r\n        STOP\r\n"
    assert format_source("stop\rstop\n//\r\n") == "        STOP\r        STOP\n//\r\n"
    assert format_source("stop\r\nstop\nstop") == "        STOP\r\n        STOP\n        STOP\r\n"
    assert format_source("") == ""
    assert format_source("\n\n") == "\n\n"


def test_a_very_long_label_does_not_move_the_column():
    text = "a_label_of_more_than_twenty_four_characters: STOP\nb: STOP"
    assert format_source(text).splitlines()[1] == "b:      STOP"


def includes(name, _from):
    return name, "STOP // from a file"


@given(SOURCES)
@example("//! DATA 1,2,3,4 //! DATA 5,6,7,8")
@settings(max_examples=80)
def test_formatting_keeps_the_meaning_and_is_done_at_once(text):
    formatted = format_source(text)
    assert format_source(formatted) == formatted
    before, after = (assemble(t, include=includes) for t in (text, formatted))
    assert [code.instruction for code in before.code] == [code.instruction for code in after.code]
    assert [d.code for d in before.diagnostics] == [d.code for d in after.diagnostics]
    assert [(s.name, s.value) for s in before.symbols.values()] == [
        (s.name, s.value) for s in after.symbols.values()
    ]


@given(SOURCES)
@example("\r \n// note")
@settings(max_examples=80)
def test_formatting_keeps_every_comment_and_every_blank_line(text):
    def comments(source):
        tokens = [
            token for line in split_lines(source.removeprefix("\ufeff")) for token in tokenize(line)[-1:]
        ]
        return [
            token.text.rstrip()
            for token in tokens
            if token.kind == "comment" and "DATA" not in token.text.upper()
        ]

    formatted = format_source(text)
    assert comments(formatted) == comments(text)
    blank = [not line.strip() for line in split_lines(text)]
    while (
        len(blank) > 1 and blank[-1] and split_lines(text)[-1] == "" and len(blank) == len(split_lines(text))
    ):
        blank.pop()
    assert [not line.strip() for line in split_lines(formatted)][: len(blank)] == blank


def test_a_name_that_is_no_word_keeps_its_letters():
    assert format_source("jc Loop\nmvp Abs, 0, 1\nmvp Target, 0, 1\n") == (
        "        JC    Loop\n        MVP   ABS, 0, 1\n        MVP   Target, 0, 1\n"
    )


def kept(text):
    """What formatting must keep of a text: its words and comments, the former without regard to case."""
    tokens = [token for line in split_lines(text) for token in tokenize(line)]
    return [t.text.rstrip() if t.kind == "comment" else t.text.upper() for t in tokens]


@given(
    SOURCES.filter(lambda text: lexical_mistake(text) is None)
    | st.text(st.sampled_from("aB1 ,:=()//\r\n\t"), max_size=80),
    st.sampled_from(
        [Encoding("utf-8", b"\xef\xbb\xbf"), Encoding("utf-8"), Encoding("utf-16-le", b"\xff\xfe")]
    ),
)
@settings(max_examples=120)
def test_a_formatted_file_holds_the_same_words_and_comments_in_the_same_encoding(text, encoding):
    stored = decode(encode(text.replace("\0", " "), encoding))
    formatted = encode(format_source(stored[0]), stored[1])
    again = decode(formatted)
    assert again[1] == stored[1]
    assert [word for word in kept(again[0]) if "DATA" not in word.upper()] == [
        word for word in kept(stored[0]) if "DATA" not in word.upper()
    ]


ENCODINGS = (
    Encoding("utf-8"), Encoding("utf-8", b"\xef\xbb\xbf"), Encoding("utf-16-le", b"\xff\xfe"),
    Encoding("utf-16-be", b"\xfe\xff"), Encoding("windows-1252"),
)  # fmt: skip
COMMENTS = ("", " // caf\u00e9 \u201cquoted\u201d \u2122", "\t//\u00a0x\u00a0", " // \u20ac 5  ")


def stored(text, comment, encoding):
    return encode(text.replace("\0", " ").replace("\n", f"{comment}\n"), encoding)


FILES = st.binary(max_size=200) | st.builds(
    stored, SOURCES.filter(str.isascii), st.sampled_from(COMMENTS), st.sampled_from(ENCODINGS)
)


@given(FILES)
@settings(max_examples=150)
def test_fmt_leaves_a_file_as_it_is_or_keeps_what_it_says(data):
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, "x.tmc")
        path.write_bytes(data)
        status = CliRunner().invoke(command, [str(path)], standalone_mode=False)
        after = path.read_bytes()
    if status.exception is not None or status.return_value:
        assert isinstance(status.exception, CliError | None)
        assert after == data
        return
    (before, encoding), (formatted, again) = decode(data), decode(after)
    assert again == encoding or after.isascii()
    squeezed = [["".join(word.split()).upper() for word in kept(text)] for text in (before, formatted)]
    assert squeezed[0] == squeezed[1]


@given(st.text(max_size=300))
@settings(max_examples=80)
def test_any_text_can_be_formatted(text):
    formatted = format_source(text)
    assert format_source(formatted) == formatted


@given(SOURCES)
@settings(max_examples=40)
def test_parsing_a_formatted_instruction_gives_it_back(text):
    for instruction in assemble(text, include=includes).program:
        assert parse_instruction(format_instruction(instruction)) == instruction
