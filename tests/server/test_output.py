"""Lines that nobody reads hold up nobody who writes them."""

import os

from tmcm34x.server import output
from tmcm34x.server.output import OutputLines


def test_lines_arrive_in_order():
    reads, writes = os.pipe()
    lines = OutputLines(writes)
    for number in range(100):
        lines.write(f"{number}\n")
    lines.close()
    os.close(writes)
    with os.fdopen(reads) as stream:
        assert stream.read().split() == [str(number) for number in range(100)]


def test_a_pipe_that_is_not_read_holds_up_nothing_and_what_is_missing_is_counted(monkeypatch):
    monkeypatch.setattr(output, "LONGEST_QUEUE", 10)
    reads, writes = os.pipe()
    lines = OutputLines(writes)
    count = 3000  # of 100 bytes: more than a pipe and the queue hold
    for number in range(count):
        lines.write(f"{number:99}\n")
    with os.fdopen(reads) as stream:
        seen = [stream.readline()]
        while lines._missing and not lines._lines.empty():
            seen.append(stream.readline())
        lines.write("last\n")
        while seen[-1] != "last\n":
            seen.append(stream.readline())
    lines.close()
    os.close(writes)
    notes = [line for line in seen if line.startswith("(")]
    missing = sum(int(note.split()[0].strip("(")) for note in notes)
    assert missing > 0
    assert len(seen) - len(notes) + missing == count + 1


def test_an_output_that_is_closed_at_the_other_end_is_reported():
    reads, writes = os.pipe()
    os.close(reads)
    lines, errors = OutputLines(writes), []
    lines.lost = errors.append
    lines.write("anything\n")
    lines.close()
    os.close(writes)
    assert [type(error) for error in errors] == [BrokenPipeError]
