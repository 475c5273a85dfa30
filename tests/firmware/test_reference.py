from __future__ import annotations

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from firmware.programs import Wire, direct, program_of
from tmcm34x.bench import Rig, build
from tmcm34x.bench.description import parse
from tmcm34x.chips.tmc423 import Tmc423
from tmcm34x.clock import MS, run_until
from tmcm34x.firmware.axis import ReferenceSearch
from tmcm34x.firmware.module import FirmwareModule

LEAD_MM = 8.0
USTEPS_PER_MM = 200 * 64 / LEAD_MM
HYSTERESIS_MM = 0.2

SWITCHES = {
    "left": f"left = {{position = 5.0, hysteresis = {HYSTERESIS_MM}}}",
    "right": "right = {position = 45.0, hysteresis = 0.1}",
    "reference": f"reference = {{position = 20.0, width = 2.0, hysteresis = {HYSTERESIS_MM}}}",
}


def axis(*switches: str, start: float = 30.0) -> str:
    lines = "\n".join(SWITCHES[name] for name in switches)
    return f"""
[[module.axis]]
load = {{kind = "carriage", lead_mm = {LEAD_MM}, low = 0.0, high = 50.0, start = {start}}}
[module.axis.switch]
{lines}
"""


def rig_of(*axes: str, program: str = "STOP") -> tuple[Rig, FirmwareModule]:
    rig = build(parse("[[module]]\n" + "".join(axes)))
    module = rig.modules[0]
    module.eeprom.write_program(program_of(program))
    return rig, module


def run_ms(rig: Rig, milliseconds: float) -> None:
    run_until(rig, rig.now + round(milliseconds * MS))


def search(rig: Rig, motor: int = 0, limit_ms: int = 60_000) -> None:
    """Run until the search has ended."""
    limit = rig.now + limit_ms * MS
    while rig.modules[0].axes[motor].search and rig.now < limit:
        rig.advance(min(rig.next_event(), limit))
    assert rig.modules[0].axes[motor].search is ReferenceSearch.IDLE


def carriage_mm(rig: Rig, motor: int = 0) -> float:
    return rig.worlds[0].view()[motor].position


def value(module: FirmwareModule, line: str) -> int:
    status, value = direct(module, line)
    assert status == 100
    return value


@pytest.mark.parametrize("start", [30.0, 5.1, 4.9, 2.0])
def test_mode_1_puts_zero_in_the_middle_of_the_two_switching_points(start: float) -> None:
    rig, module = rig_of(axis("left", start=start))
    direct(module, "RFS START, 0")
    search(rig)
    assert (value(module, "GAP 1, 0"), value(module, "GAP 0, 0"), value(module, "GAP 3, 0")) == (0, 0, 0)
    assert carriage_mm(rig) == pytest.approx(5.0 + HYSTERESIS_MM / 2, abs=0.01)


class Shaft:
    """An encoder's shaft that stays where it is."""

    edges_per_turn = 4000
    null_level = None

    def edges(self) -> int:
        return 5000


def test_the_counter_of_an_encoder_is_set_with_the_position() -> None:
    rig, module = rig_of(axis("left"))
    module.board.attach_spi(0, Tmc423([Shaft()] * 3))
    value(module, "SGP 74, 0, 1")
    value(module, "SAP 209, 0, 5000")
    value(module, "RFS START, 0")
    search(rig)
    closed_mm = HYSTERESIS_MM / 2
    assert value(module, "GAP 209, 0") / USTEPS_PER_MM == pytest.approx(-closed_mm, abs=0.01)


@pytest.mark.parametrize("mode", [2, 3])
@pytest.mark.parametrize("start", [30.0, 47.0, 3.0])
def test_mode_2_finds_both_switches_and_measures_their_distance(mode: int, start: float) -> None:
    rig, module = rig_of(axis("left", "right", start=start))
    direct(module, f"SAP 193, 0, {mode}")
    direct(module, "RFS START, 0")
    search(rig)
    assert value(module, "GAP 1, 0") == 0
    assert carriage_mm(rig) == pytest.approx(5.0 + HYSTERESIS_MM / 2, abs=0.01)
    expected = 45.0 - 5.0 - HYSTERESIS_MM / 2
    assert value(module, "GAP 196, 0") / USTEPS_PER_MM == pytest.approx(expected, abs=0.01)


@pytest.mark.parametrize("mode", [2, 3])
def test_a_search_that_starts_on_the_right_switch_takes_its_edge(mode):
    distances = []
    for start in (30.0, 45.0, 49.0):
        rig, module = rig_of(axis("left", "reference", "right", start=start))
        value(module, f"SAP 193, 0, {mode}")
        value(module, "RFS START, 0")
        assert (value(module, "RFS STATUS, 0") == ReferenceSearch.LEAVING_RIGHT) is (start >= 45)
        search(rig)
        distances.append(value(module, "GAP 196, 0"))
    assert max(distances) - min(distances) <= 2, distances


def test_a_quarter_of_a_tiny_speed_is_no_speed():
    rig, module = rig_of(axis("left", start=2.0))
    value(module, "SAP 4, 0, 3")
    value(module, "RFS START, 0")
    run_ms(rig, 60_000)
    assert value(module, "RFS STATUS, 0") == ReferenceSearch.LEAVING
    assert value(module, "GAP 3, 0") == 0
    value(module, "SAP 195, 0, 1000")
    value(module, "RFS START, 0")
    search(rig)


@pytest.mark.parametrize("start", [30.0, 10.0, 20.5])
def test_mode_3_takes_the_reference_switch_wherever_it_starts(start: float) -> None:
    rig, module = rig_of(axis("left", "right", "reference", start=start))
    direct(module, "SAP 193, 0, 3")
    direct(module, "RFS START, 0")
    search(rig)
    assert value(module, "GAP 1, 0") == 0
    assert carriage_mm(rig) == pytest.approx(21.0 + HYSTERESIS_MM / 2, abs=0.01)


def test_a_circular_axis_needs_one_switch_only() -> None:
    rig, module = rig_of("""
[[module.axis]]
load = {kind = "turntable", ratio = 4.0, start = 100.0}
switch = {reference = {position = 10.0, width = 6.0, hysteresis = 1.0}}
""")
    rig.worlds[0].set_switch(0, "right", True)
    for _ in range(2):
        direct(module, "RFS START, 0")
        search(rig)
        assert value(module, "GAP 1, 0") == 0
        assert carriage_mm(rig) % 360 == pytest.approx(13.5, abs=0.05)
        direct(module, "MVP REL, 0, 20000")
        run_ms(rig, 3000)


def top_speeds(*settings: str) -> tuple[int, int]:
    """The speeds of the way to the switch and of measuring it."""
    rig, module = rig_of(axis("left"))
    for line in settings:
        direct(module, line)
    direct(module, "RFS START, 0")
    speeds: dict[ReferenceSearch, int] = {}
    while module.axes[0].search:
        state = module.axes[0].search
        rig.advance(rig.next_event())
        speeds[state] = max(speeds.get(state, 0), abs(value(module, "GAP 3, 0")))
    return speeds[ReferenceSearch.GOING_LEFT], speeds[ReferenceSearch.REENTERING]


def test_search_and_switch_speed_are_parameters_194_and_195() -> None:
    assert top_speeds("SAP 4, 0, 800") == (800, 200)
    assert top_speeds("SAP 4, 0, 800", "SAP 194, 0, 600", "SAP 195, 0, 100") == (600, 100)


def test_status_tells_what_the_search_does() -> None:
    rig, module = rig_of(axis("left"))
    assert value(module, "RFS STATUS, 0") == 0
    direct(module, "RFS START, 0")
    assert value(module, "RFS STATUS, 0") == ReferenceSearch.GOING_LEFT
    search(rig)
    assert value(module, "RFS STATUS, 0") == 0


def test_a_search_goes_through_its_states_in_order() -> None:
    rig, module = rig_of(axis("left", "right", start=47.0))
    direct(module, "SAP 193, 0, 3")
    direct(module, "RFS START, 0")
    states = [value(module, "RFS STATUS, 0")]
    while states[-1]:
        rig.advance(rig.next_event())
        if (state := value(module, "RFS STATUS, 0")) != states[-1]:
            states.append(state)
    assert states == [6, 1, 2, 3, 4, 5, 0]


def test_stop_leaves_off_and_the_motor_comes_to_rest() -> None:
    rig, module = rig_of(axis("left"))
    direct(module, "SAP 13, 0, 1")
    direct(module, "RFS START, 0")
    run_ms(rig, 300)
    assert direct(module, "RFS STOP, 0")[0] == 100
    assert value(module, "RFS STATUS, 0") == 0
    run_ms(rig, 500)
    assert value(module, "GAP 3, 0") == 0
    assert value(module, "GAP 1, 0") != 0
    assert direct(module, "RFS STOP, 0")[0] == 100


@pytest.mark.parametrize("line", ["ROR 0, 100", "MVP ABS, 0, 500", "MST 0"])
def test_a_motion_command_ends_the_search(line: str) -> None:
    rig, module = rig_of(axis("left"))
    direct(module, "RFS START, 0")
    run_ms(rig, 200)
    direct(module, line)
    assert value(module, "RFS STATUS, 0") == 0


def test_stop_switch_parameters_have_no_influence_and_come_back() -> None:
    rig, module = rig_of(axis("left", "right"))
    for line in ("SAP 12, 0, 1", "SAP 13, 0, 1", "SAP 193, 0, 2", "RFS START, 0"):
        direct(module, line)
    search(rig)
    assert carriage_mm(rig) == pytest.approx(5.0 + HYSTERESIS_MM / 2, abs=0.01)
    direct(module, "ROL 0, 500")
    run_ms(rig, 2000)
    assert carriage_mm(rig) < 4.0


@pytest.mark.parametrize("stretch", [ReferenceSearch.LEAVING, ReferenceSearch.GOING_TO_ZERO])
@pytest.mark.parametrize(("mode", "stops"), [(1, False), (2, True), (3, True)])
def test_the_right_switch_stops_a_search_in_modes_2_and_3_only(
    mode: int, stops: bool, stretch: ReferenceSearch
) -> None:
    """To the end: on both stretches that lead to the right after the left switch."""
    rig, module = rig_of(axis("left", "right"))
    direct(module, f"SAP 193, 0, {mode}")
    direct(module, "RFS START, 0")
    while module.axes[0].search is not stretch:
        rig.advance(rig.next_event())
    rig.worlds[0].set_switch(0, "right", True)
    run_ms(rig, 5000)
    assert value(module, "RFS STATUS, 0") == (stretch if stops else ReferenceSearch.IDLE)
    assert value(module, "GAP 3, 0") == 0
    rig.worlds[0].set_switch(0, "right", None)
    search(rig)
    assert value(module, "GAP 1, 0") == 0


def test_a_switch_that_never_comes_leaves_the_program_to_its_time_out() -> None:
    rig, module = rig_of(
        axis(),
        program="RFS START, 0 \n WAIT RFS, 0, 300 \n JC ETO, Late \n STOP \n Late: RFS STOP, 0 \n SIO 0, 2, 1 \n STOP",
    )
    module.program.run()
    run_ms(rig, 2990)
    assert module.board.outputs == 0
    assert value(module, "RFS STATUS, 0") == ReferenceSearch.GOING_LEFT
    run_ms(rig, 20)
    assert module.board.outputs == 1
    assert value(module, "RFS STATUS, 0") == 0


def test_three_axes_search_at_once() -> None:
    rig, module = rig_of(
        axis("left"),
        axis("left", "right", start=10.0),
        axis("left", "right", "reference", start=40.0),
        program="""
            SAP 193, 1, 2
            SAP 193, 2, 3
            RFS START, 0
            RFS START, 1
            RFS START, 2
            WAIT RFS, 0, 0
            WAIT RFS, 1, 0
            WAIT RFS, 2, 0
            STOP
        """,
    )
    module.program.run()
    run_ms(rig, 60_000)
    assert not module.program.active
    assert [value(module, f"GAP 1, {motor}") for motor in range(3)] == [0, 0, 0]
    zeros = [carriage_mm(rig, motor) - HYSTERESIS_MM / 2 for motor in range(3)]
    assert zeros == pytest.approx([5.0, 5.0, 21.0], abs=0.01)


def test_motors_of_a_group_search_together() -> None:
    rig, module = rig_of(axis("left"), axis("left", start=20.0))
    direct(module, "SAP 213, 0, 7")
    direct(module, "SAP 213, 1, 7")
    direct(module, "RFS START, 1")
    search(rig, 0)
    search(rig, 1)
    assert carriage_mm(rig, 0) == pytest.approx(carriage_mm(rig, 1), abs=0.01)


def test_bouncing_contacts_do_not_spoil_the_search() -> None:
    rig, module = rig_of(axis("left") + "bounce_ms = 3.0\n")
    direct(module, "RFS START, 0")
    search(rig)
    assert carriage_mm(rig) == pytest.approx(5.0 + HYSTERESIS_MM / 2, abs=0.15)


def test_status_over_the_wire_is_polled_to_the_end() -> None:
    rig, module = rig_of(axis("left"))
    wire = Wire(module)
    assert wire.ask(13, 0, 0).status == 100
    polls = 0
    while wire.ask(13, 2, 0).value:
        run_ms(rig, 10)
        polls += 1
    assert 100 < polls < 5000


@settings(max_examples=8)
@given(st.lists(st.integers(1, 2_000_000), max_size=30))
def test_slicing_does_not_change_a_search(slices: list[int]) -> None:
    def outcome(slices: list[int]) -> list[tuple[int, int]]:
        rig, module = rig_of(axis("left", "right", start=8.0))
        direct(module, "SAP 193, 0, 2")
        direct(module, "RFS START, 0")
        for length in slices:
            run_until(rig, rig.now + length)
        run_until(rig, 16_000 * MS)
        return [(number, value(module, f"GAP {number}, 0")) for number in (0, 1, 3, 196)]

    assert outcome(slices) == outcome([])
