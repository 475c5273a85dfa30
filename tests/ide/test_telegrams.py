"""The telegram log: which reply belongs to which request, and how long it took."""

from __future__ import annotations

import sys
import threading

import pytest

from tmcm34x.ide.telegrams import Telegrams
from tmcm34x.tmcl.datagram import (
    Instruction,
    Reply,
    pack_can_reply,
    pack_can_request,
    pack_reply,
    pack_request,
)

GAP, MVP = 6, 4


def _pairs(telegrams: Telegrams) -> list[tuple[int, float]]:
    lines = telegrams.since(0)
    assert lines is not None
    return [(line.request, line.latency) for line in lines.lines]


def test_a_reply_names_its_request_and_the_time_between():
    telegrams = Telegrams()
    telegrams.write(100, "a", ">", pack_request(1, Instruction(GAP, 1)))
    telegrams.write(150, "b", ">", pack_request(1, Instruction(GAP, 1)))
    telegrams.write(180, "a", "<", pack_reply(Reply(2, 1, 100, GAP, 7)))
    telegrams.write(300, "b", "<", pack_reply(Reply(2, 1, 100, GAP, 7)))
    telegrams.write(310, "b", "<", pack_reply(Reply(2, 1, 100, GAP, 7)))
    assert _pairs(telegrams) == [(0, 0), (0, 0), (1, 80), (2, 150), (0, 0)]


def test_both_replies_of_138_belong_to_it():
    telegrams = Telegrams()
    telegrams.write(0, "a", ">", pack_request(1, Instruction(138, 0, 0, 1)))
    telegrams.write(10, "a", "<", pack_reply(Reply(2, 1, 100, 138, 1)))
    telegrams.write(20, "a", ">", pack_request(1, Instruction(MVP, 0, 0, 500)))
    telegrams.write(30, "a", "<", pack_reply(Reply(2, 1, 100, MVP, 500)))
    telegrams.write(9000, "a", "<", pack_reply(Reply(2, 1, 128, 138, 1)))
    assert _pairs(telegrams) == [(0, 0), (1, 10), (0, 0), (3, 10), (1, 9000)]


def test_replies_of_their_own_form_frames_and_lines_are_paired_too():
    telegrams = Telegrams()
    telegrams.write(0, "a", ">", pack_request(1, Instruction(136)))
    telegrams.write(5, "a", "<", b"\x02343V4.36")
    telegrams.write(10, "c", ">", pack_can_request(Instruction(GAP, 1)), "frame")
    telegrams.write(13, "c", "<", pack_can_reply(Reply(0, 1, 100, GAP, 0)), "frame")
    telegrams.write(20, "t", ">", b"AGAP 1, 0\r", "text")
    telegrams.write(27, "t", "<", b"BA 100 0\r", "text")
    assert _pairs(telegrams) == [(0, 0), (1, 5), (0, 0), (3, 3), (0, 0), (5, 7)]


@pytest.fixture
def hasty():
    """Threads take turns all the time."""
    before = sys.getswitchinterval()
    sys.setswitchinterval(1e-6)
    yield
    sys.setswitchinterval(before)


def test_each_telegram_that_a_line_notes_is_read_once_meanwhile(hasty):
    telegrams, count = Telegrams(), 3000

    def note():
        for number in range(count):
            telegrams.write(number, "a", ">", pack_request(1, Instruction(GAP, 1)))

    threads = [threading.Thread(target=note) for _ in range(2)]
    for thread in threads:
        thread.start()
    seen, skipped = [0], 0
    while seen[-1] < 2 * count:
        lines = telegrams.since(seen[-1])
        if lines is not None:
            seen += [line.number for line in lines.lines]
            skipped += lines.dropped
    for thread in threads:
        thread.join()
    assert seen == sorted(set(seen))
    assert len(seen) - 1 + skipped == 2 * count
