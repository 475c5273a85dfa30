"""Bytes of source files to text and back."""

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tmcm34x.toolchain.encoding import Encoding, EncodingError, decode, encode


@pytest.mark.parametrize(
    ("data", "text", "codec"),
    [
        ("// größer".encode(), "// größer", "utf-8"),
        ("// größer".encode("latin-1"), "// größer", "windows-1252"),
        (b"// \x93Loop\x94\x99", "// \u201cLoop\u201d\u2122", "windows-1252"),
        (b"// \x81\x90\xff", "// \x81\x90\xff", "windows-1252"),
        (b"\xef\xbb\xbfSTOP", "STOP", "utf-8"),
        (b"\xff\xfeS\0T\0", "ST", "utf-16-le"),
        (b"\xfe\xff\0S\0T", "ST", "utf-16-be"),
        (b"", "", "utf-8"),
    ],
)
def test_text_that_is_not_utf_8_is_windows_1252(data, text, codec):
    assert decode(data)[0] == text
    assert decode(data)[1].codec == codec
    assert encode(*decode(data)) == data


@pytest.mark.parametrize(
    ("data", "reason"),
    [
        (b"\xff\xfeS", "not UTF-16-LE at byte 2"),
        (b"\xff\xfe\x00\xd8a\0", "not UTF-16-LE at byte 2"),
        (b"\xef\xbb\xbf\xff", "not UTF-8 at byte 3"),
        (b"S\0T\0O\0P\0", "UTF-16 without a byte order mark"),
        (b"STOP\n\0", "not a text: character 6 is zero"),
    ],
)
def test_what_holds_no_text_is_refused_with_the_reason(data, reason):
    with pytest.raises(EncodingError, match=reason):
        decode(data)


@given(st.binary(max_size=200))
@settings(max_examples=300)
def test_what_was_decoded_is_encoded_to_the_same_bytes(data):
    try:
        text, encoding = decode(data)
    except EncodingError:
        return
    assert encode(text, encoding) == data


def test_a_character_that_the_encoding_does_not_have_is_refused():
    with pytest.raises(EncodingError, match="windows-1252"):
        encode("π", Encoding("windows-1252"))
