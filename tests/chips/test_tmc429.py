"""The TMC429 and TMC428 behind their datagram: registers, status, switches, interrupts, driver chain."""

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from chips.harness import TICK, chip_with, events_until, get_field, path, set_field
from tmcm34x.chips import registers
from tmcm34x.chips.registers import BY_NAME, COMMON, FIELDS, REGISTERS, data
from tmcm34x.chips.tmc429 import Coils, Tmc429
from tmcm34x.clock import HZ, NEVER, run_until

LEFT, RIGHT = 0b10, 0b01
"""The input lines of motor 0."""


def with_right_inputs():
    chip = Tmc429()
    set_field(chip, COMMON, "EN_REFR", 1)
    return chip


def turning(v_target=500, chip=None, **values):
    """A chip whose motor 0 has reached a speed in velocity mode."""
    chip = chip or with_right_inputs()
    settings_of_motor = {"RAMP_DIV": 3, "PULSE_DIV": 3, "V_MAX": 2047, "A_MAX": 2000, "RAMP_MODE": 2} | values
    for name, value in settings_of_motor.items():
        set_field(chip, 0, name, value)
    set_field(chip, 0, "V_TARGET", v_target)
    run_until(chip, chip.now + HZ // 10)
    return chip


# ---- registers


def test_status_after_power_on_is_three_times_at_target():
    chip = Tmc429()
    assert chip.read_status() == 0x15
    assert chip.transfer(BY_NAME["X_TARGET"].write(5, 0)) == 0x15000000
    assert chip.read_status() == 0x14
    assert chip.transfer(BY_NAME["X_TARGET"].read(0)) == 0x14000005


@pytest.mark.parametrize("part", ["TMC428", "TMC429"])
@pytest.mark.parametrize("register", REGISTERS, ids=lambda register: register.name)
def test_registers_read_their_power_on_value(register, part):
    chip = Tmc429(part)
    expected = register.reset if part in register.parts else 0
    if register.name == "COVER_POSITION_LEN":
        expected = 1 << 8
    assert data(chip.transfer(register.read(1))) == expected


PLAIN = [
    register
    for register in REGISTERS
    if register.writable and register.name not in ("X_ACTUAL", "INTERRUPTS", "V_TARGET", "COVER_POSITION_LEN")
]


@pytest.mark.parametrize("part", ["TMC428", "TMC429"])
@pytest.mark.parametrize("register", PLAIN, ids=lambda register: register.name)
def test_registers_keep_their_writable_bits_and_nothing_else(register, part):
    for pattern in (0xFFFFFF, 0xAAAAAA, 0x555555, 0):
        chip = Tmc429(part)
        chip.transfer(register.write(pattern, 2))
        expected = pattern & register.writable | register.ones if part in register.parts else 0
        assert data(chip.transfer(register.read(2))) == expected
        if register.area != COMMON:
            assert data(chip.transfer(register.read(1))) == register.reset


def test_addresses_without_a_register_read_zero_and_take_no_writes():
    for part in ("TMC428", "TMC429"):
        chip = Tmc429(part)
        for index in (7, 10, 11, 12, 13):
            chip.transfer(registers.write(COMMON, index, 0xFFFFFF))
            assert chip.transfer(registers.read(COMMON, index)) == 0x15000000


def test_type_and_version_are_the_tmc429s_alone():
    assert data(Tmc429("TMC429").transfer(BY_NAME["TYPE_VERSION"].read())) == 0x429101
    assert data(Tmc429("TMC428").transfer(BY_NAME["TYPE_VERSION"].read())) == 0


def test_pmul_has_its_highest_bit_fixed():
    chip = Tmc429()
    chip.transfer(BY_NAME["PMUL_PDIV"].write(0x7A06, 0))
    assert data(chip.transfer(BY_NAME["PMUL_PDIV"].read(0))) == 0xFA06


def test_cover_position_reads_one_more_than_written():
    chip = Tmc429()
    chip.transfer(BY_NAME["COVER_POSITION_LEN"].write(23 << 8 | 12))
    assert data(chip.transfer(BY_NAME["COVER_POSITION_LEN"].read())) == 24 << 8 | 12


def test_v_actual_is_written_in_every_mode_and_clears_the_fraction():
    for mode in range(4):
        chip = Tmc429()
        for name, value in {"RAMP_MODE": mode, "RAMP_DIV": 13, "V_ACTUAL": -700}.items():
            set_field(chip, 0, name, value)
        assert chip.velocity(0) == get_field(chip, 0, "V_ACTUAL") == -700


def test_reset_forgets_everything_but_the_input_lines():
    chip = turning()
    chip.set_reference_inputs(0b101010)
    chip.reset()
    fresh = Tmc429()
    fresh.set_reference_inputs(0b101010)
    for register in REGISTERS:
        for motor in range(3):
            assert chip.transfer(register.read(motor)) == fresh.transfer(register.read(motor))
    assert chip.next_event() == NEVER


# ---- time


def test_a_chip_at_rest_has_no_events():
    chip = Tmc429()
    assert chip.next_event() == NEVER
    chip.advance(10**15)
    assert chip.next_event() == NEVER


def test_time_does_not_go_back():
    chip = Tmc429()
    chip.advance(100)
    with pytest.raises(ValueError, match="cannot go back"):
        chip.advance(99)


def test_time_has_no_clock_never():
    with pytest.raises(ValueError, match="NEVER"):
        Tmc429().advance(NEVER)


def test_power_down_stops_motion_until_the_next_transfer():
    chip = turning()
    place = chip.position(0)
    chip.transfer(BY_NAME["POWER_DOWN"].write(0))
    assert chip.next_event() == NEVER
    chip.advance(chip.now + HZ)
    assert chip.position(0) == place
    assert chip.read_status() & 1 == 0
    chip.advance(chip.now + HZ)
    assert chip.position(0) - place == pytest.approx(HZ * 500 / (2048 * 32 * 8), abs=1)


def test_input_lines_that_change_in_power_down_act_when_it_ends():
    chip = turning()
    place = chip.position(0)
    chip.transfer(BY_NAME["POWER_DOWN"].write(0))
    assert chip.reaches(0, place + 10) == NEVER
    assert chip.stays_within(0, place, place + 10) == chip.now
    chip.set_reference_inputs(RIGHT)
    chip.advance(chip.now + HZ)
    assert chip.position(0) == place
    chip.transfer(BY_NAME["SWITCHES"].read())
    run_until(chip, chip.now + HZ)
    assert (chip.velocity(0), chip.position(0)) == (0, pytest.approx(place, abs=1))


def test_power_down_delays_a_driver_datagram_under_way():
    chip = three_drivers()
    arrived = []
    chip.driver_status = lambda: arrived.append(chip.now) or 0
    chip.transfer(BY_NAME["COVER_DATAGRAM"].write(0))
    chip.advance(640)
    chip.transfer(BY_NAME["POWER_DOWN"].write(0))
    chip.advance(640 + HZ)
    assert not arrived
    assert chip.read_status() & registers.CDGW
    run_until(chip, chip.now + HZ)
    assert arrived == [HZ + 32 * 41]


@settings(max_examples=120)
@given(
    st.sampled_from(["TMC428", "TMC429"]),
    st.lists(
        st.tuples(
            st.one_of(
                st.integers(0, 2**32 - 1),
                st.builds(
                    lambda register, motor, value: register.write(value, motor),
                    st.sampled_from([row for row in REGISTERS if row.name != "POWER_DOWN"]),
                    st.integers(0, 2),
                    st.one_of(st.integers(0, 2**24 - 1), st.integers(0, 2047)),
                ),
                st.builds(lambda levels: -levels, st.integers(1, 63)),
            ),
            st.lists(st.integers(1, 100_000), min_size=1, max_size=4),
        ),
        max_size=30,
    ),
)
def test_any_datagrams_are_answered_and_slices_of_time_change_nothing(part, script):
    sliced, whole = Tmc429(part), Tmc429(part)
    for chip in (sliced, whole):
        chip.driver_status = lambda: 0x123456789ABC
    for request, slices in script:
        if request < 0:
            sliced.set_reference_inputs(-request)
            whole.set_reference_inputs(-request)
        else:
            reply = sliced.transfer(request)
            assert 0 <= reply < 2**32
            assert reply == whole.transfer(request)
        for clocks in slices:
            run_until(sliced, sliced.now + clocks)
        run_until(whole, sliced.now)
        assert sliced.next_event() == whole.next_event()
        assert [sliced.state(motor).save() for motor in range(3)] == [
            whole.state(motor).save() for motor in range(3)
        ]
        assert sliced.driver_datagram() == whole.driver_datagram()


# ---- switches


@pytest.mark.parametrize(
    ("settings_of_chip", "lines", "switches"),
    [
        ({}, 0b111111, 0b101010),
        ({}, 0b010101, 0),
        ({"MOT1R": 1}, 0b100000, 0b000001),
        ({"MOT1R": 1}, 0b001010, 0b001010),
        ({"EN_REFR": 1}, 0b110110, 0b110110),
        ({"INV_REF": 1}, 0b000010, 0b101000),
        ({"INV_REF": 1, "MOT1R": 1}, 0b100000, 0b001010),
        ({"INV_REF": 1, "EN_REFR": 1}, 0b110110, 0b001001),
    ],
)
def test_lines_become_switches_as_configured(settings_of_chip, lines, switches):
    chip = Tmc429()
    chip.set_reference_inputs(lines)
    for name, value in settings_of_chip.items():
        set_field(chip, COMMON, name, value)
    assert data(chip.transfer(BY_NAME["SWITCHES"].read())) == switches
    assert chip.read_status() & 0b101010 == switches & 0b101010


def test_multiplexed_lines_are_read_by_the_next_driver_datagram():
    chip = Tmc429()
    for name, value in {"REFMUX": 1, "LSMD": 2, "CONTINUOUS_UPDATE": 1}.items():
        set_field(chip, COMMON, name, value)
    chip.set_reference_inputs(0b111111)
    assert get_field(chip, COMMON, "L1") == 0
    request = 1024 * TICK
    assert events_until(chip, request + 1311) == [request]
    assert get_field(chip, COMMON, "L1") == 0
    run_until(chip, request + 1312)
    assert data(chip.transfer(BY_NAME["SWITCHES"].read())) == 0b111111
    assert chip.next_event() == NEVER


def test_multiplexed_lines_are_read_when_a_motor_steps():
    chip = Tmc429()
    for name, value in {"REFMUX": 1, "LSMD": 2}.items():
        set_field(chip, COMMON, name, value)
    chip = turning(chip=chip)
    chip.set_reference_inputs(0b000100)
    step, _ = next(chip.steps(0, chip.now, chip.now + HZ))
    assert events_until(chip, step + 1312) == [step, step + 1312]
    assert get_field(chip, COMMON, "R2") == 1


def test_a_hard_stop_comes_with_the_next_ramp_tick_and_motion_away_stays_possible():
    chip = turning(400)
    set_field(chip, 0, "MASK_STOP", 1)
    chip.set_reference_inputs(RIGHT)
    tick = chip.now // TICK
    stopped = (tick // 8 * 8 + 8) * TICK
    assert chip.next_event() == stopped
    run_until(chip, stopped)
    assert chip.velocity(0) == 0
    assert get_field(chip, 0, "INT_STOP") == 1
    place = chip.position(0)
    run_until(chip, chip.now + HZ)
    assert chip.position(0) == place
    set_field(chip, 0, "V_TARGET", -400)
    run_until(chip, chip.now + HZ)
    assert chip.position(0) < place


def test_the_motor_starts_again_when_the_switch_opens():
    chip = turning(400)
    chip.set_reference_inputs(RIGHT)
    run_until(chip, chip.now + HZ)
    assert chip.velocity(0) == 0
    chip.set_reference_inputs(0)
    run_until(chip, chip.now + HZ)
    assert chip.velocity(0) == 400


def test_only_the_switch_in_the_direction_of_motion_stops_and_only_if_enabled():
    for lines, name in ((LEFT, None), (RIGHT, "DISABLE_STOP_R")):
        chip = turning(400)
        if name:
            set_field(chip, 0, name, 1)
        chip.set_reference_inputs(lines)
        run_until(chip, chip.now + HZ)
        assert chip.velocity(0) == 400


def test_a_soft_stop_takes_a_ramp():
    chip = turning(400, SOFT_STOP=1, A_MAX=100)
    chip.set_reference_inputs(RIGHT)
    place = chip.position(0)
    start = chip.now
    while chip.velocity(0):
        chip.advance(chip.next_event())
    assert (chip.now - start) / TICK / 8 == pytest.approx(400 * 256 / 100, abs=1)
    assert chip.position(0) - place == pytest.approx(400 * 1024 / 2 / 2048, abs=2)


def test_the_tolerance_window_around_zero_ignores_the_switch():
    chip = turning(400, DX_REF_TOLERANCE=100)
    set_field(chip, 0, "X_ACTUAL", 0)
    chip.set_reference_inputs(RIGHT)
    run_until(chip, chip.now + HZ)
    assert chip.velocity(0) == 0
    assert chip.position(0) == 101


@pytest.mark.parametrize(("rnl", "line"), [(0, LEFT), (1, RIGHT)])
def test_the_reference_switch_latches_the_position_on_either_edge_while_moving(rnl, line):
    chip = turning(-300, REF_RNL=rnl, DISABLE_STOP_L=1)
    latch = BY_NAME["X_LATCHED"]
    for lines in (line, 0):
        chip.transfer(latch.write(0, 0))
        assert get_field(chip, 0, "LP") == 1
        run_until(chip, chip.now + HZ // 50)
        place = chip.position(0)
        chip.set_reference_inputs(lines)
        assert get_field(chip, 0, "LP") == 0
        assert get_field(chip, 0, "X_LATCHED") == place
        run_until(chip, chip.now + HZ // 50)
    chip.set_reference_inputs(line)
    assert get_field(chip, 0, "X_LATCHED") == place


def test_a_switch_that_changes_at_rest_latches_nothing():
    chip = with_right_inputs()
    chip.transfer(BY_NAME["X_LATCHED"].write(0, 0))
    chip.set_reference_inputs(LEFT)
    assert get_field(chip, 0, "LP") == 1


# ---- interrupts


def test_flags_need_their_mask_are_cleared_by_ones_and_raise_the_interrupt_bit():
    chip = with_right_inputs()
    interrupts = BY_NAME["INTERRUPTS"]
    chip.set_reference_inputs(LEFT)
    assert data(chip.transfer(interrupts.read(0))) == 0
    chip.transfer(interrupts.write(0xF000, 0))
    chip.set_reference_inputs(RIGHT)
    assert data(chip.transfer(interrupts.read(0))) == 0xF090
    assert chip.read_status() & registers.INT
    chip.transfer(interrupts.write(0xF010, 0))
    assert data(chip.transfer(interrupts.read(0))) == 0xF080
    chip.transfer(interrupts.write(0x1000, 0))
    assert data(chip.transfer(interrupts.read(0))) == 0x1000
    assert not chip.read_status() & registers.INT


def test_arriving_sets_pos_end():
    chip = chip_with(v_min=1, v_max=500, a_max=500, ramp_div=3, pulse_div=3, p_mul=200, p_div=3)
    set_field(chip, 0, "MASK_POS_END", 1)
    set_field(chip, 0, "X_TARGET", 1000)
    assert get_field(chip, 0, "INT_POS_END") == 0
    while chip.position(0) != 1000:
        assert get_field(chip, 0, "INT_POS_END") == 0
        chip.advance(chip.next_event())
    assert get_field(chip, 0, "INT_POS_END") == 1


def test_the_position_compare_interrupt_comes_with_its_step():
    chip = turning(500)
    for name, value in {"POS_COMP_SEL": 0, "POS_COMP": chip.position(0) + 77, "MASK_POS_COMP": 1}.items():
        set_field(chip, COMMON, name, value)
    expected = [clock for clock, _ in chip.steps(0, chip.now, chip.now + HZ)][76]
    assert events_until(chip, expected) == [expected]
    assert get_field(chip, COMMON, "INT_POS_COMP") == 1
    assert chip.read_status() & registers.INT
    chip.transfer(BY_NAME["POS_COMP_INT"].write(0x101))
    assert get_field(chip, COMMON, "INT_POS_COMP") == 0


def test_the_position_compare_interrupt_comes_when_the_present_position_is_written():
    chip = Tmc429()
    set_field(chip, COMMON, "MASK_POS_COMP", 1)
    set_field(chip, COMMON, "POS_COMP_SEL", 0)
    chip.transfer(BY_NAME["POS_COMP"].write(77))
    assert get_field(chip, COMMON, "INT_POS_COMP") == 0
    chip.transfer(BY_NAME["POS_COMP"].write(0))
    assert get_field(chip, COMMON, "INT_POS_COMP") == 1
    assert chip.read_status() & registers.INT


# ---- RAM and driver chain


def test_the_tmc429_wakes_up_with_a_chain_for_three_tmc236_and_a_sine():
    chip = Tmc429()
    cells = []
    for address in range(64):
        word = data(chip.transfer(registers.read_ram(address)))
        cells += [word & 63, word >> 8]
    assert cells[:12] == [0x11, 0x05, 0x04, 0x03, 0x02, 0x06, 0x11, 0x0D, 0x0C, 0x0B, 0x0A, 0x2E]
    assert cells[:12] * 3 == cells[:36]
    assert cells[64:74] == [0, 2, 3, 5, 6, 8, 9, 11, 12, 14]
    assert cells[119:] == [62, 63, 63, 63, 63, 63, 63, 63, 63]


def test_the_tmc428_wakes_up_with_noise_from_its_seed():
    def ram(seed):
        chip = Tmc429("TMC428", seed=seed)
        return [chip.transfer(registers.read_ram(address)) for address in range(64)]

    assert ram(1) == ram(1) != ram(2)


def test_ram_is_written_two_cells_at_a_time():
    chip = Tmc429()
    chip.transfer(registers.write_ram(40, 13, 63))
    assert data(chip.transfer(registers.read_ram(40))) == 63 << 8 | 13
    assert data(chip.transfer(registers.read_ram(41))) == 29 << 8 | 27


def three_drivers():
    chip = Tmc429()
    set_field(chip, COMMON, "LSMD", 2)
    return chip


def test_a_driver_datagram_holds_the_words_of_the_drivers_first_motor_first():
    chip = three_drivers()
    # MDA 1, CA 0000, PHA 1, MDB 1, CB 1111, PHB 1 for each motor in phase 0
    word = 0b1_0000_1_1_1111_1
    assert chip.driver_datagram() == (word << 24 | word << 12 | word, 36)
    set_field(chip, COMMON, "POL_PH_AB", 1)
    word = 0b1_0000_0_1_1111_0
    assert chip.driver_datagram() == (word << 24 | word << 12 | word, 36)


def test_a_cover_datagram_is_sent_at_once_and_waited_for_in_cdgw():
    chip = three_drivers()
    asked = []

    def status():
        asked.append((chip.now, chip.driver_datagram()))
        return 0xABCDEF123456

    chip.driver_status = status
    chip.advance(1000)
    before, _ = chip.driver_datagram()
    chip.transfer(BY_NAME["COVER_POSITION_LEN"].write(12 << 8 | 12))
    chip.transfer(BY_NAME["COVER_DATAGRAM"].write(0x0F0))
    assert chip.read_status() & registers.CDGW
    assert get_field(chip, COMMON, "CW") == 1
    assert chip.next_event() == 1000 + 32 * 41
    run_until(chip, 1000 + 32 * 41)
    covered = before & ~(0xFFF << 12) | 0x0F0 << 12
    assert asked == [(1000 + 32 * 41, (covered, 36))]
    assert not chip.read_status() & registers.CDGW
    assert chip.driver_datagram() == (before, 36)
    assert get_field(chip, COMMON, "DATAGRAM_HIGH_WORD") == 0


def test_armed_datagram_words_are_refreshed_by_a_cover_datagram_or_a_microstep():
    chip = three_drivers()
    chip.driver_status = lambda: 0xABCDEF123456
    chip.transfer(BY_NAME["DATAGRAM_LOW_WORD"].write(0))
    assert chip.read_status() & registers.CDGW
    assert chip.next_event() == NEVER
    chip.transfer(BY_NAME["COVER_DATAGRAM"].write(0))
    run_until(chip, 32 * 41)
    assert not chip.read_status() & registers.CDGW
    assert data(chip.transfer(BY_NAME["DATAGRAM_HIGH_WORD"].read())) == 0xABCDEF
    assert data(chip.transfer(BY_NAME["DATAGRAM_LOW_WORD"].read())) == 0x123456

    chip = turning(chip=chip)
    chip.driver_status = lambda: 7
    chip.transfer(BY_NAME["DATAGRAM_HIGH_WORD"].write(0))
    step, _ = next(chip.steps(0, chip.now, chip.now + HZ))
    assert events_until(chip, step + 32 * 41) == [step, step + 32 * 41]
    assert data(chip.transfer(BY_NAME["DATAGRAM_LOW_WORD"].read())) == 7


def test_a_cover_datagram_waits_for_the_one_under_way():
    chip = three_drivers()
    arrived = []
    chip.driver_status = lambda: arrived.append(chip.now) or 0
    chip.transfer(BY_NAME["COVER_DATAGRAM"].write(0))
    chip.advance(640)
    chip.transfer(BY_NAME["COVER_DATAGRAM"].write(1))
    assert chip.read_status() & registers.CDGW
    run_until(chip, HZ)
    assert arrived == [32 * 41, 2 * 32 * 41]
    assert not chip.read_status() & registers.CDGW


def test_a_chain_without_end_keeps_a_cover_datagram_waiting():
    chip = three_drivers()
    for address in range(18):
        chip.transfer(registers.write_ram(address, 0x10, 0x10))
    chip.transfer(BY_NAME["COVER_DATAGRAM"].write(0))
    assert chip.next_event() == NEVER
    assert chip.read_status() & registers.CDGW
    for address in (5, 11, 17):
        chip.transfer(registers.write_ram(address, 0x10, 0x30))
    run_until(chip, 32 * 41)
    assert not chip.read_status() & registers.CDGW


@pytest.mark.parametrize(
    ("wave", "coils"),
    [
        (0, Coils(0, 63, 1, 1, 0, 1)),
        (32, Coils(45, 45, 1, 1, 0, 1)),
        (64, Coils(63, 0, 1, 0, 1, 0)),
        (65, Coils(63, 2, 1, 0, 1, 0)),
        (128, Coils(0, 63, 0, 0, 0, 1)),
        (192, Coils(63, 0, 0, 1, 1, 0)),
        (255, Coils(2, 63, 0, 1, 1, 0)),
    ],
)
def test_phases_currents_and_decay_follow_the_quadrants(wave, coils):
    chip = turning(USRS=6)
    clock = next(
        clock
        for (clock, _), phase in zip(
            chip.steps(0, chip.now, chip.now + HZ), range(chip.phase(0) + 1, 10**6), strict=False
        )
        if phase % 256 == wave
    )
    run_until(chip, clock)
    assert chip.phase(0) == wave
    assert chip.coil_currents(0) == coils


def test_falling_motion_swaps_the_decay_bits():
    up, down = turning(300), turning(-300)
    set_field(up, 0, "V_TARGET", 0)
    set_field(down, 0, "V_TARGET", 0)
    run_until(up, up.now + HZ)
    run_until(down, down.now + HZ)
    assert (up.coil_currents(0).fd_a ^ up.phase(0) >> 6) & 1 == 0
    assert (down.coil_currents(0).fd_a ^ down.phase(0) >> 6) & 1 == 1


def test_microstep_resolution_steps_the_wave():
    for usrs in range(8):
        chip = turning(300, USRS=usrs)
        assert chip.phase(0) == chip.position(0) * (64 >> min(usrs, 6)) % 256


def test_current_scales_follow_acceleration_and_rest():
    chip = with_right_inputs()
    for name, value in {"IS_AGTAT": 6, "IS_ALEAT": 4, "IS_V0": 2, "A_THRESHOLD": 100}.items():
        set_field(chip, 0, name, value)
    assert chip.coil_currents(0).dac_b == 63 * 4 >> 3
    delay = 255 * TICK
    assert events_until(chip, delay) == [delay]
    assert chip.coil_currents(0).dac_b == 63 * 2 >> 3
    chip = turning(2000, chip=chip, A_MAX=200, RAMP_DIV=6, USRS=0)
    assert chip.acceleration(0) == 200
    assert max(chip.coil_currents(0)[:2]) == 63 * 6 >> 3
    run_until(chip, chip.now + HZ)
    assert chip.acceleration(0) == 0
    assert max(chip.coil_currents(0)[:2]) == 63 * 4 >> 3


def test_with_step_and_direction_outputs_there_are_no_driver_datagrams():
    chip = turning()
    set_field(chip, COMMON, "EN_SD", 1)
    chip.transfer(BY_NAME["COVER_DATAGRAM"].write(0))
    events = events_until(chip, chip.now + HZ)
    assert events == []
    assert chip.read_status() & registers.CDGW


def test_watching_costs_one_event_and_a_range_already_left_none():
    chip = turning(500)
    place = chip.position(0)
    chip.watch(0, place - 10, place + 10)
    (left,) = events_until(chip, chip.now + HZ)
    assert [clock for clock, _ in chip.steps(0, chip.now, chip.now + 1)] == []
    assert chip.position(0) > place + 10
    assert left < chip.now
    chip.watch(0, -(2**23), 2**23 - 1)
    assert events_until(chip, chip.now + HZ) == []


def test_three_axes_do_not_disturb_each_other():
    chip, alone = Tmc429(), Tmc429()
    axis = {"V_MIN": 1, "V_MAX": 900, "RAMP_DIV": 5, "PULSE_DIV": 4, "PMUL": 247, "PDIV": 4, "A_MAX": 400}
    for motor in range(3):
        for name, value in axis.items():
            set_field(chip, motor, name, value)
        set_field(chip, motor, "X_TARGET", 1000 * (motor + 1))
    for name, value in axis.items():
        set_field(alone, 2, name, value)
    set_field(alone, 2, "X_TARGET", 3000)
    run_until(chip, HZ // 3)
    run_until(alone, HZ // 3)
    assert chip.state(2).save() == alone.state(2).save()
    path(chip)
    assert [chip.position(motor) for motor in range(3)] == [1000, 2000, 3000]


def test_every_field_of_the_map_can_be_read_by_name():
    chip = Tmc429()
    for name, (register, field) in FIELDS.items():
        value = get_field(chip, 1, name)
        assert value == (1 if name == "COVER_POSITION" else field.get(register.reset))


# ---- events


@pytest.mark.parametrize(
    "values",
    [{}, {"A_MAX": 37}, {"X_TARGET": 900}, {"V_MAX": 31, "V_MIN": 30}, {"RAMP_DIV": 0}, {"RAMP_MODE": 1}],
)
def test_an_event_at_the_target_or_at_rest_is_more_than_another_acceleration(values):
    chip = Tmc429()
    plain = {"RAMP_DIV": 7, "PULSE_DIV": 3, "V_MIN": 1, "V_MAX": 1000, "A_MAX": 1000, "PMUL": 247, "PDIV": 6}
    for name, value in ({**plain, "X_TARGET": 30_000} | values).items():
        set_field(chip, 0, name, value)
    target, changes = chip.axes[0].x_target, []
    while (due := chip.next_event()) < NEVER:
        chip.advance(due)
        changes.append(chip.changed_motors())
        if chip.position(0) == target or not chip.velocity(0):
            assert chip.changed_motors() == 1
    assert set(changes) == {0, 1}
    assert chip.position(0) == target
    chip.advance(chip.now + 1)
    assert not chip.changed_motors()


def positioning(x_target):
    chip = Tmc429()
    values = {"RAMP_DIV": 7, "PULSE_DIV": 3, "V_MIN": 1, "V_MAX": 1000, "A_MAX": 1000, "PMUL": 247, "PDIV": 6}
    for name, value in (values | {"X_TARGET": x_target}).items():
        set_field(chip, 0, name, value)
    return chip


def test_asking_where_an_axis_will_be_changes_nothing():
    """What an event means to the motors is found with its clock; another question of the future has another answer."""

    def changes(asks):
        chip = positioning(3000)
        found = []
        while chip.next_event() < NEVER:
            if asks:
                place = chip.position(0)
                chip.reaches(0, place + 1)
                chip.stays_within(0, place - 1, place + 1)
            chip.advance(chip.next_event())
            found.append((chip.now, chip.changed_motors()))
        return found

    assert len(changes(asks=False)) > 3
    assert changes(asks=True) == changes(asks=False)


def test_where_an_axis_will_be_is_told_until_its_next_event():
    chip = positioning(300_000)
    chip.advance(chip.next_event())
    place = chip.position(0)
    leaves = chip.stays_within(0, place, place + 40)
    foretold = [chip.position_at(0, when) for when in range(leaves - 3 * TICK, leaves + TICK, TICK)]
    assert leaves < chip.next_event()
    chip.advance(leaves)
    assert foretold == [place + 40] * 3 + [place + 41]
    assert chip.position(0) == place + 41
