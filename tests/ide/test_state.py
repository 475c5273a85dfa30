from __future__ import annotations

from hypothesis import given, settings
from hypothesis import strategies as st

from tmcm34x.ide import wire
from tmcm34x.ide.state import Frames, bits, empty, put


def test_a_page_gets_everything_once_and_then_only_what_changed():
    frames, state = Frames(), empty()
    first = frames.frame(state)
    assert first[0] == (1 << len(wire.GROUPS)) - 1
    assert len(first) == 1 + sum(group.layout.size for group in wire.GROUPS)
    assert frames.frame(state) == b""
    put(state, "time", 16_000_000, 1.0, 1.0, 2)
    second = frames.frame(state)
    assert second[0] == 1
    assert second[1:] == state[0]
    assert frames.frame(state) == b""


def test_watched_values_come_last_and_only_when_they_change():
    frames, state = Frames(), empty()
    frames.frame(state)
    expected = bytes((1 << wire.WATCH_BIT, 0b101, 1, 0, 0, 0, 0, 0, 0, 0, 0xFE, 0xFF, 0xFF, 0xFF))
    assert frames.frame(state, [1, None, -2]) == expected
    assert frames.frame(state, [1, None, -2]) == b""


def test_flags_count_from_bit_0():
    assert bits(True, False, True) == 5


@settings(max_examples=50)
@given(st.lists(st.lists(st.integers(0, 5), max_size=6), max_size=12))
def test_a_page_that_puts_frames_together_has_the_state(changes):
    """Whatever changes between frames: what is not sent again has not changed."""
    frames, state = Frames(), empty()
    known = [b""] * len(wire.GROUPS)
    for step, groups in enumerate(changes):
        for index in groups:
            size = wire.GROUPS[index].layout.size
            state[index] = bytes([step % 256]) * size
        frame = frames.frame(state)
        at = 1
        for index, group in enumerate(wire.GROUPS):
            if frame and frame[0] & 1 << index:
                known[index] = frame[at : at + group.layout.size]
                at += group.layout.size
        assert known == state
        assert at == max(1, len(frame))
