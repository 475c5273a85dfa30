"""Bytes of a source file to text, and text back to bytes in the same encoding.

A byte order mark decides; without one the file is UTF-8 where that is well formed, else Windows-1252, whose five
undefined bytes stand for the control characters of the same number.  What `decode` takes, `encode` gives back byte
for byte.  A NUL is in no source text: images and UTF-16 without its mark are refused (fidelity TOOL-3).
"""

from __future__ import annotations

import codecs
from typing import Final, NamedTuple


class Encoding(NamedTuple):
    """How the text of a file was stored: a codec, and the byte order mark before it."""

    codec: str
    mark: bytes = b""


class EncodingError(ValueError):
    """A file that is not source text, with the reason for a message that names the file."""


UTF_8: Final = Encoding("utf-8")
_WINDOWS: Final = Encoding("windows-1252")
_MARKED: Final = (
    Encoding("utf-8", codecs.BOM_UTF8),
    Encoding("utf-16-le", codecs.BOM_UTF16_LE),
    Encoding("utf-16-be", codecs.BOM_UTF16_BE),
)
_UNDEFINED: Final = frozenset({0x81, 0x8D, 0x8F, 0x90, 0x9D})
"""Bytes that Windows-1252 gives no character."""
_DECODING: Final = {
    byte: byte if byte in _UNDEFINED else ord(bytes((byte,)).decode("cp1252")) for byte in range(256)
}
_ENCODING: Final = {character: byte for byte, character in _DECODING.items()}


def decode(data: bytes) -> tuple[str, Encoding]:
    """The text in the bytes of a file, and how it was stored; raises `EncodingError` where it holds no text."""
    for encoding in _MARKED:
        if data.startswith(encoding.mark):
            return _checked(_strict(data[len(encoding.mark) :], encoding)), encoding
    if len(data) > 1 and 0 in data and not (any(data[1:40:2]) and any(data[0:40:2])):
        raise EncodingError("UTF-16 without a byte order mark; save it as UTF-8")
    try:
        return _checked(data.decode(UTF_8.codec)), UTF_8
    except UnicodeDecodeError:
        return _checked(codecs.charmap_decode(data, "strict", _DECODING)[0]), _WINDOWS


def encode(text: str, encoding: Encoding) -> bytes:
    """The bytes of `text` stored like the file that it came from; raises `EncodingError` for other characters."""
    try:
        if encoding.codec == _WINDOWS.codec:
            return codecs.charmap_encode(_checked(text), "strict", _ENCODING)[0]
        return encoding.mark + _checked(text).encode(encoding.codec)
    except UnicodeEncodeError as error:
        character = text[error.start]
        raise EncodingError(f"{character!r} is not in {encoding.codec}") from None


def _strict(data: bytes, encoding: Encoding) -> str:
    try:
        return data.decode(encoding.codec)
    except UnicodeDecodeError as error:
        place = len(encoding.mark) + error.start
        raise EncodingError(
            f"not {encoding.codec.upper()} at byte {place}, as its byte order mark says"
        ) from None


def _checked(text: str) -> str:
    if "\0" in text:
        raise EncodingError(f"not a text: character {text.index(chr(0)) + 1} is zero")
    return text
