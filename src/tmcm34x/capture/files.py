"""Recordings by a file's name: which form a file has is seen in its contents, which it shall get in its name."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from pathlib import Path
from typing import IO, Any, Final, NamedTuple

from tmcm34x.bench.session.errors import SessionSyntaxError
from tmcm34x.capture import candump, hexlog, pcapng, session_file
from tmcm34x.capture.record import NO_IDENTIFIER, Record, RecordingError
from tmcm34x.files import read_bytes

PCAPNG_MAGIC: Final = bytes.fromhex("0a0d0d0a")


class Form(NamedTuple):
    """One row of `FORMS`.

    begin: gives a function from a record to what it adds to a file
    """

    suffix: str
    meaning: str
    begin: Callable[[], Callable[[Record], bytes]]


def _session() -> Callable[[Record], bytes]:
    writer = session_file.SessionWriter()
    return lambda record: writer.lines(record).encode("utf-8")


def _pcapng() -> Callable[[Record], bytes]:
    return pcapng.PcapngWriter().blocks


def _candump() -> Callable[[Record], bytes]:
    return lambda record: candump.line(record).encode("ascii")


def _hexlog() -> Callable[[Record], bytes]:
    return lambda record: hexlog.line(record).encode("ascii")


FORMS: Final = (
    Form(".session", "session with times", _session),
    Form(".pcapng", "for Wireshark", _pcapng),
    Form(".log", "candump, CAN frames only", _candump),
    Form(".hex", "hexadecimal text", _hexlog),
)
BY_SUFFIX: Final = {form.suffix: form for form in FORMS}


def read(path: Path) -> list[Record]:
    """The records of a file, in the order of time.  Raises `RecordingError`."""
    try:
        data = read_bytes(path)
        records = _read(data, path)
    except OSError as error:
        raise RecordingError(f"{path}: {error.strerror}") from None
    except SessionSyntaxError as error:
        raise RecordingError(str(error)) from None
    except RecordingError as error:
        raise RecordingError(f"{path}: {error}") from None
    if not records:
        raise RecordingError(f"{path}: no telegrams in this file")
    return sorted(records, key=lambda record: record.time_ns)


def _read(data: bytes, path: Path) -> list[Record]:
    if data.startswith(PCAPNG_MAGIC):
        return pcapng.read(data)
    if b"\0" in data:
        raise RecordingError("neither text nor a pcapng file")
    text = data.decode("utf-8", "replace")
    rows = text.splitlines()
    if any(row.startswith("==") for row in rows):
        return _read_session(text, path)
    if any(row.startswith("(") and "#" in row for row in rows):
        return candump.read(text)
    return hexlog.read(text)


def _read_session(text: str, path: Path) -> list[Record]:
    """The records of a session, whose last line may be cut off."""
    try:
        return session_file.read(text, path)
    except SessionSyntaxError as error:
        rows = text.split("\n")
        if not rows[-1] or error.line != len(rows):
            raise
        return session_file.read("\n".join(rows[:-1]) + "\n", path)


def form_of(path: Path) -> Form:
    """The form that a file gets by its name.  Raises `RecordingError`."""
    form = BY_SUFFIX.get(path.suffix.lower())
    if form is None:
        known = ", ".join(f"{form.suffix} ({form.meaning})" for form in FORMS)
        raise RecordingError(f"{path}: recordings are {known}")
    return form


class RecordingWriter:
    """Writes a recording while it is made, record by record; a context manager.

    anonymous: name lines by number, and leave out texts
    Raises `RecordingError`.
    """

    def __init__(self, path: Path, *, anonymous: bool = False) -> None:
        self._path = path
        self._form = form_of(path)
        self._anonymous = anonymous
        self._names: dict[str, str] = {}
        self.count = 0
        """Records so far."""
        self._add = self._form.begin()
        try:
            self._file: IO[Any] = path.open("wb")
        except OSError as error:
            raise RecordingError(f"{path}: {error.strerror}") from None

    def add(self, record: Record) -> None:
        """Write one."""
        if self._anonymous:
            if record.kind == "text":
                return
            number = self._names.setdefault(record.line, str(len(self._names) + 1))
            record = record._replace(line=number)
        try:
            self._file.write(self._add(record))
            self._file.flush()
        except OSError as error:
            raise RecordingError(f"{self._path}: {error.strerror}") from None
        self.count += 1

    def close(self) -> None:
        """End the file."""
        self._file.close()

    def __enter__(self) -> RecordingWriter:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


def write(records: Iterable[Record], path: Path, *, anonymous: bool = False) -> int:
    """Write a recording; returns how many records the file's form could take.  Raises `RecordingError`."""
    written = 0
    with RecordingWriter(path, anonymous=anonymous) as recorder:
        for record in records:
            recorder.add(record)
            written += path.suffix != ".log" or record.identifier != NO_IDENTIFIER
    return written
