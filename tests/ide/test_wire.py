from __future__ import annotations

import struct
from pathlib import Path

import msgspec
import pytest

from tmcm34x.board.models import MODELS
from tmcm34x.ide import wire
from tmcm34x.ide.typescript import typescript
from tmcm34x.ide.vocabulary import model_shape

WEB = Path(__file__).parents[2] / "web"


def test_the_pages_side_of_the_wire_is_fresh():
    assert (WEB / "src" / "wire.ts").read_text(encoding="utf-8") == typescript()


def test_all_group_bits_fit_below_the_watch_bit():
    assert len(wire.GROUPS) <= wire.WATCH_BIT


def test_a_group_is_packed_without_padding():
    for group in wire.GROUPS:
        assert group.layout.size == sum(struct.calcsize("<" + row.code) for row in group.rows)


def test_every_flag_has_a_bit_in_its_field():
    widths = {"B": 8, "H": 16}
    fields = {group.name: {row.name: row.code for row in group.rows} for group in wire.GROUPS}
    assert len(wire.MOTOR_FLAGS) <= widths[fields["motor0"]["flags"]]
    assert len(wire.TIME_FLAGS) <= widths[fields["time"]["flags"]]
    assert len(wire.PROGRAM_FLAGS) <= widths[fields["program"]["flags"]]


def test_a_request_is_a_number_and_a_tagged_call():
    request = msgspec.json.decode(b'[7, {"call": "execute", "number": 1, "value": 500}]', type=wire.Request)
    assert request == (7, wire.Execute(1, value=500))


@pytest.mark.parametrize(
    "text",
    [
        "",
        "{}",
        "[1]",
        '[1, {"call": "nonsense"}]',
        '[1, {"call": "execute"}]',
        '[1, {"call": "ping", "more": 1}]',
    ],
)
def test_a_malformed_request_is_refused(text: str):
    with pytest.raises((msgspec.DecodeError, msgspec.ValidationError)):
        msgspec.json.decode(text.encode(), type=wire.Request)


@pytest.mark.parametrize(
    ("model", "drivers", "max_current_ma", "pin"),
    [(341, True, None, 32), (342, False, None, 43), (343, True, 1100, 44)],
)
def test_a_model_is_shown_as_the_manual_has_it_and_nothing_is_made_up(model, drivers, max_current_ma, pin):
    shape = model_shape(MODELS[model], known=True)
    assert (shape.drivers, shape.max_current_ma, shape.shutdown_pin) == (drivers, max_current_ma, pin)
