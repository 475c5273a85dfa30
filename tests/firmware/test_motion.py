from __future__ import annotations

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from firmware.hosts import Host, switched_on
from tmcm34x.chips.ramp import brake_factor
from tmcm34x.clock import HZ, MS, NEVER, run_until
from tmcm34x.firmware.axis import MOTOR_FIELDS

MODELS = pytest.mark.parametrize("model", [341, 342, 343])


def register(module, motor, name):
    """The field of a motor's register, as the chip has it."""
    return module.axes[motor].read(MOTOR_FIELDS[name])


@MODELS
@pytest.mark.parametrize("motor", range(3))
def test_ror_and_rol_turn_in_velocity_mode_with_any_speed(model, motor):
    host = Host(switched_on(model))
    assert host.do(f"ROR {motor}, 1500") == 1500
    host.wait_ms(500)
    assert [host.do(f"GAP {n}, {motor}") for n in (138, 2, 3)] == [2, 1500, 1500]
    assert host.do(f"GAP 1, {motor}") > 0
    host.do(f"ROL {motor}, 2047")
    host.wait_ms(1500)
    assert [host.do(f"GAP {n}, {motor}") for n in (2, 3)] == [-2047, -2047]
    host.do(f"ROR {motor}, -3")
    host.wait_ms(1000)
    assert host.do(f"GAP 3, {motor}") == -3
    assert host.do(f"GAP 4, {motor}") == 1000
    for other in {0, 1, 2} - {motor}:
        assert host.do(f"GAP 1, {other}") == 0


@MODELS
def test_mst_leaves_the_target_speed_at_zero_and_stops_along_the_ramp(model):
    host = Host(switched_on(model))
    host.do("MVP ABS, 1, 1000000")
    host.wait_ms(500)
    host.do("MST 1")
    assert [host.do(f"GAP {n}, 1") for n in (138, 2)] == [2, 0]
    assert host.do("GAP 3, 1") == 1000
    host.wait_ms(30)
    assert 300 < host.do("GAP 3, 1") < 700
    host.wait_ms(100)
    assert host.do("GAP 3, 1") == 0


@MODELS
@pytest.mark.parametrize("target", [5000, -5000, 1, 8388607, -8388608, 0])
def test_mvp_abs_goes_there(model, target):
    host = Host(switched_on(model))
    host.do("SAP 1, 0, 0")
    host.do(f"SAP 1, 0, {max(-8388608, min(8388607, target - 3000))}")
    assert host.do(f"MVP ABS, 0, {target}") == target
    host.wait_ms(1000)
    assert [host.do(f"GAP {n}, 0") for n in (1, 0, 8, 138, 3)] == [target, target, 1, 0, 0]


def test_mvp_rel_counts_from_the_actual_position():
    host = Host(switched_on())
    host.do("MVP ABS, 0, 50000")
    host.wait_ms(500)
    here = host.do("GAP 1, 0")
    assert host.do("MVP REL, 0, -1000") == -1000
    assert host.do("GAP 0, 0") == here - 1000


def test_mvp_restores_the_limits_that_rotating_opened():
    module = switched_on()
    host = Host(module)
    host.do("SAP 4, 0, 700")
    host.do("ROR 0, 2000")
    assert register(module, 0, "V_MAX") == 2047
    host.do("SAP 4, 0, 600")
    assert register(module, 0, "V_MAX") == 2047
    host.wait_ms(1000)
    assert host.do("GAP 3, 0") == 2000
    host.do("MVP REL, 0, 1000000")
    assert register(module, 0, "V_MAX") == 600
    host.wait_ms(1000)
    assert host.do("GAP 3, 0") == 600


def test_ramp_mode_may_be_chosen_by_hand():
    module = switched_on()
    host = Host(module)
    host.do("SAP 138, 0, 2")
    host.do("SAP 2, 0, 1800")
    host.wait_ms(1000)
    assert host.do("GAP 3, 0") == 1800
    host.do("SAP 0, 0, 0")
    assert host.do("GAP 3, 0") == 1800
    host.do("SAP 138, 0, 1")
    assert register(module, 0, "V_MAX") == 1000
    host.wait_ms(20_000)
    assert [host.do(f"GAP {n}, 0") for n in (1, 3, 8)] == [0, 0, 1]


def test_target_speed_reads_the_limit_while_speeding_up_and_zero_while_braking():
    host = Host(switched_on())
    host.do("MVP ABS, 0, -20000")
    seen = []
    for _ in range(200):
        host.wait_ms(5)
        seen.append(host.do("GAP 2, 0"))
    assert set(seen) == {-1000, 0}
    assert seen == sorted(seen)
    host.do("MVP ABS, 0, 0")
    host.wait_ms(20)
    assert host.do("GAP 2, 0") == 1000


def test_writing_the_target_position_moves_in_position_mode_only():
    host = Host(switched_on())
    host.do("SAP 0, 0, 500")
    host.wait_ms(500)
    assert host.do("GAP 1, 0") == 500
    host.do("ROR 0, 0")
    host.do("SAP 0, 0, 900")
    host.wait_ms(500)
    assert host.do("GAP 1, 0") == 500


def test_writing_the_actual_position_alone_makes_the_motor_go_back():
    host = Host(switched_on())
    host.do("SAP 1, 0, 300")
    assert host.do("GAP 8, 0") == 0
    host.wait_ms(500)
    assert [host.do(f"GAP {n}, 0") for n in (1, 8)] == [0, 1]


@pytest.mark.parametrize(
    ("parameter", "values"), [(5, (0, 1, 37, 2047)), (153, (0, 4, 13)), (154, (0, 7, 13))]
)
def test_acceleration_and_divisors_recompute_the_braking_factors(parameter, values):
    module = switched_on()
    host = Host(module)
    for value in values:
        host.do(f"SAP {parameter}, 1, {value}")
        settings_ = [host.do(f"GAP {n}, 1") for n in (5, 153, 154)]
        assert register(module, 1, {5: "A_MAX", 153: "RAMP_DIV", 154: "PULSE_DIV"}[parameter]) == value
        assert (register(module, 1, "PMUL"), register(module, 1, "PDIV")) == brake_factor(*settings_)


# Switches


@MODELS
@pytest.mark.parametrize(
    ("side", "status", "disable", "line"), [("left", 11, 13, "ROL"), ("right", 10, 12, "ROR")]
)
def test_a_switch_stops_the_motor_that_runs_toward_it(model, side, status, disable, line):
    module = switched_on(model)
    host = Host(module)
    host.do(f"{line} 1, 500")
    host.wait_ms(200)
    module.board.set_switch(1, side, True)
    host.wait_ms(1)
    assert [host.do(f"GAP {n}, 1") for n in (3, status)] == [0, 1]
    assert host.do("GAP 9, 1") == (side == "left")
    other = {"ROL": "ROR", "ROR": "ROL"}[line]
    host.do(f"{other} 1, 300")
    host.wait_ms(200)
    assert abs(host.do("GAP 3, 1")) == 300
    host.do(f"{line} 1, 300")
    host.wait_ms(500)
    assert host.do("GAP 3, 1") == 0
    host.do(f"SAP {disable}, 1, 1")
    host.wait_ms(200)
    assert abs(host.do("GAP 3, 1")) == 300


def test_soft_stop_brakes_along_the_ramp():
    module = switched_on()
    host = Host(module)
    host.do("SAP 149, 0, 1")
    host.do("ROR 0, 1000")
    host.wait_ms(500)
    module.board.set_switch(0, "right", True)
    host.wait_ms(20)
    assert 0 < host.do("GAP 3, 0") < 1000
    host.wait_ms(200)
    assert host.do("GAP 3, 0") == 0


# Several motors


def test_a_group_moves_together():
    host = Host(switched_on())
    host.do("SAP 213, 0, 9")
    host.do("SAP 213, 2, 9")
    host.do("ROR 2, 100")
    assert [host.do(f"GAP 2, {motor}") for motor in range(3)] == [100, 0, 100]
    host.do("MST 0")
    assert [host.do(f"GAP 2, {motor}") for motor in range(3)] == [0, 0, 0]
    host.wait_ms(100)
    here = [host.do(f"GAP 1, {motor}") for motor in range(3)]
    host.do("MVP REL, 0, 500")
    assert [host.do(f"GAP 0, {motor}") - here[motor] for motor in range(3)] == [500, 0, 500]
    host.do("MVP ABS, 1, 77")
    assert [host.do(f"GAP 0, {motor}") for motor in range(3)] == [here[0] + 500, 77, here[2] + 500]
    for motor in range(3):
        host.do(f"SCO 4, {motor}, {motor * 10}")
    host.do("MVP COORD, 2, 4")
    assert [host.do(f"GAP 0, {motor}") for motor in range(3)] == [0, 77, 20]


def test_a_group_moves_as_a_whole_or_not_at_all():
    host = Host(switched_on())
    host.do("SAP 213, 0, 9")
    host.do("SAP 213, 1, 9")
    host.do("SAP 0, 1, 8388000")
    host.do("SAP 1, 1, 8388000")
    assert host.status("MVP REL, 0, 1000") == 4
    assert host.do("GAP 0, 0") == 0


@MODELS
def test_mvp_coord_takes_one_motor_or_several(model):
    host = Host(switched_on(model))
    for motor in range(3):
        host.do(f"SCO 5, {motor}, {1000 * (motor + 1)}")
    host.do("MVP COORD, 1, 5")
    assert [host.do(f"GAP 0, {motor}") for motor in range(3)] == [0, 2000, 0]
    host.do("MVP COORD, $85, 5")
    assert [host.do(f"GAP 0, {motor}") for motor in range(3)] == [1000, 2000, 3000]


@pytest.mark.parametrize(
    "line",
    [
        "MVP COORD, $80, 5", "MVP COORD, $40, 5", "MVP COORD, $c7, 5", "MVP COORD, $88, 5", "MVP COORD, $87, 21",
        "MVP COORD, $47, -1", "MVP COORD, 3, 5", "MVP COORD, 0, 21", "MVP ABS, $81, 5", "MVP ABS, 0, 8388608",
        "MVP REL, 0, 8388608",
    ],
)  # fmt: skip
def test_mvp_refuses_what_makes_no_sense(line):
    assert Host(switched_on()).status(line) == 4


def arrivals(module, motors):
    """The clock at which each motor of `motors` reaches its target."""
    found = {}
    while len(found) < len(motors):
        for motor in motors:
            if motor not in found and module.axes[motor].at_target:
                found[motor] = module.now
        if len(found) < len(motors):
            assert module.next_event() != NEVER
            module.advance(module.next_event())
    return [found[motor] for motor in motors]


@settings(max_examples=25)
@given(
    ways=st.tuples(*[st.integers(-60_000, 60_000).filter(lambda way: abs(way) > 6_000)] * 3),
    divisors=st.tuples(*[st.integers(2, 4)] * 3),
)
def test_interpolated_motors_arrive_together(ways, divisors):
    module = switched_on()
    host = Host(module)
    for motor, (way, divisor) in enumerate(zip(ways, divisors, strict=True)):
        host.do(f"SCO 1, {motor}, {way}")
        host.do(f"SAP 154, {motor}, {divisor}")
    host.do("MVP COORD, $47, 1")
    assert [host.do(f"GAP {n}, {motor}") for motor in range(3) for n in (4, 5)] == [1000] * 6
    clocks = arrivals(module, range(3))
    assert max(clocks) - min(clocks) < max(clocks) * 0.03


def test_no_interpolated_motor_exceeds_its_own_limits():
    module = switched_on()
    host = Host(module)
    for line in ("SAP 4, 1, 300", "SAP 5, 0, 200", "SCO 0, 0, 40000", "SCO 0, 1, 20000", "MVP COORD, $43, 0"):
        host.do(line)
    assert [register(module, motor, "V_MAX") for motor in (0, 1)] == [600, 300]
    assert [register(module, motor, "A_MAX") for motor in (0, 1)] == [200, 100]


def test_a_motor_that_may_not_move_holds_all_of_an_interpolated_move():
    module = switched_on()
    host = Host(module)
    for line in ("SAP 4, 1, 0", "SCO 0, 0, 40000", "SCO 0, 1, 20000", "MVP COORD, $43, 0"):
        host.do(line)
    host.wait_ms(1000)
    assert [host.do(f"GAP 1, {motor}") for motor in (0, 1)] == [0, 0]


def test_interpolated_motors_keep_to_the_straight_line():
    module = switched_on()
    host = Host(module)
    for motor, way in enumerate((60_000, -30_000, 15_000)):
        host.do(f"SCO 0, {motor}, {way}")
    host.do("MVP COORD, $47, 0")
    for _ in range(19):
        host.wait_ms(100)
        x, y, z = (host.do(f"GAP 1, {motor}") for motor in range(3))
        assert abs(x + 2 * y) < 200
        assert abs(x - 4 * z) < 200
    assert x > 50_000


def test_the_longest_way_uses_the_motor_s_own_limits_and_the_next_move_all_of_them():
    module = switched_on()
    host = Host(module)
    for motor, way in enumerate((10_000, 40_000, 0)):
        host.do(f"SCO 0, {motor}, {way}")
        host.do(f"SAP 4, {motor}, 800")
    host.do("MVP COORD, $47, 0")
    assert [register(module, motor, "V_MAX") for motor in range(3)] == [200, 800, 800]
    assert [register(module, motor, "A_MAX") for motor in range(3)] == [250, 1000, 1000]
    assert (register(module, 0, "PMUL"), register(module, 0, "PDIV")) == brake_factor(250, 7, 3)
    host.do("MVP ABS, 0, -500")
    assert [register(module, 0, name) for name in ("V_MAX", "A_MAX")] == [800, 1000]
    assert (register(module, 0, "PMUL"), register(module, 0, "PDIV")) == brake_factor(1000, 7, 3)


def test_interpolation_goes_the_chip_s_shorter_way_round():
    module = switched_on()
    host = Host(module)
    for line in (
        "SAP 0, 0, 8388000",
        "SAP 1, 0, 8388000",
        "SCO 0, 0, -8388000",
        "SCO 0, 1, 2432",
        "MVP COORD, $43, 0",
    ):
        host.do(line)
    assert register(module, 1, "V_MAX") == 1000
    assert register(module, 0, "V_MAX") == 500
    first, second = arrivals(module, (0, 1))
    assert abs(first - second) < 20 * MS


def test_rotating_after_an_interpolated_move_uses_the_full_acceleration():
    module = switched_on()
    host = Host(module)
    for line in ("SCO 0, 0, 1000", "SCO 0, 1, 40000", "MVP COORD, $43, 0", "ROR 0, 500"):
        host.do(line)
    assert register(module, 0, "A_MAX") == 1000


def test_a_move_ends_where_the_closed_form_says():
    """51,200 microsteps at 1000 and A_MAX 500 take 0.84714 s as an ideal trapezoid, and 1 ms more for the last."""
    module = switched_on()
    host = Host(module)
    for line in ("SAP 4, 0, 1000", "SAP 5, 0, 500", "SAP 153, 0, 3", "SAP 154, 0, 2", "MVP ABS, 0, 51200"):
        host.do(line)
    run_until(module, round(0.84 * HZ))
    assert host.do("GAP 8, 0") == 0
    run_until(module, round(0.849 * HZ))
    assert host.do("GAP 8, 0") == 1
