"""Files that a person chooses for the page: their text, in the encodings that the tool chain reads."""

from __future__ import annotations

from tmcm34x.ide.wire import RefusalError
from tmcm34x.toolchain.encoding import EncodingError, decode


def text_of(data: bytes) -> str:
    """The text of a chosen file.  Raises `RefusalError` where it holds none."""
    try:
        return decode(data)[0]
    except EncodingError as error:
        raise RefusalError("text", f"The file cannot be read: {error}.") from error
