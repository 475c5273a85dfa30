from __future__ import annotations

import pytest

from tmcm34x.board.board import ANALOG_THRESHOLD, QUIET_DRIVER, Board
from tmcm34x.board.models import MODELS
from tmcm34x.chips.registers import FIELDS
from tmcm34x.chips.tmc246 import Tmc246
from tmcm34x.clock import HZ, NEVER, run_until


def powered(number: int) -> Board:
    """A board whose chips know how they are wired, as after the firmware's start."""
    board = Board(MODELS[number])
    for chip in range(len(board.chips)):
        board.transfer(chip, FIELDS["LSMD"][0].write(board.model.smgp))
        board.transfer(chip, FIELDS["EN_REFR"][0].write(board.model.if_configuration))
        for address in range(32):
            cells = board.model.driver_chain[2 * address : 2 * address + 2]
            board.transfer(chip, 1 << 31 | address << 25 | cells[1] << 8 | cells[0])
    return board


@pytest.mark.parametrize("number", MODELS)
@pytest.mark.parametrize("motor", range(3))
@pytest.mark.parametrize("side", ["left", "right"])
def test_each_switch_reaches_its_own_chip_input(number, motor, side):
    board = powered(number)
    board.set_switch(motor, side, True)
    assert board.switch(motor, side)
    chip, smda = board.wiring(motor)
    seen = [board.transfer(n, FIELDS["L1"][0].read()) & 0xFFFFFF for n in range(len(board.chips))]
    expected = (2 if side == "left" else 1) << 2 * smda
    assert seen == [expected if n == chip else 0 for n in range(len(board.chips))]
    board.set_switch(motor, side, False)
    assert not any(board.transfer(n, FIELDS["L1"][0].read()) & 0xFFFFFF for n in range(len(board.chips)))


def test_pins_tell_their_listeners_only_when_they_change():
    board = Board(MODELS[343])
    told = []
    board.on_pins.append(lambda: told.append(True))
    for _ in range(2):
        board.set_switch(0, "left", True)
        board.set_input(3, 1)
        board.set_shutdown(1)
    assert len(told) == 3
    assert board.shutdown_level() == 1


def test_inputs_are_digital_and_analogue_at_once():
    board = Board(MODELS[343])
    board.set_analog(2, ANALOG_THRESHOLD - 1)
    board.set_analog(5, ANALOG_THRESHOLD)
    board.set_input(7, 1)
    assert board.digital_inputs() == 0b1010_0000
    assert [board.analog_input(n) for n in (2, 5, 7)] == [511, 512, 1023]


def test_outputs_tell_their_listeners():
    board = Board(MODELS[343])
    told = []
    board.on_output.append(told.append)
    for bits in (5, 5, 255, 0):
        board.set_outputs(bits)
    assert told == [5, 255, 0]


def test_currents_tell_their_listeners_and_a_342_has_none():
    told = []
    for number in (343, 342):
        board = Board(MODELS[number])
        board.on_current.append(lambda *change: told.append(change))
        board.set_current(1, 128)
        board.driver_enable(1, False)
        board.driver_enable(1, False)
    assert told == [(1, 128, True), (1, 128, False)]


class Echo:
    def __init__(self):
        self.seen = []

    def exchange(self, data, nbytes):
        self.seen.append((data, nbytes))
        return data + 1


def test_the_spi_bus_moves_as_many_bytes_as_asked():
    board = Board(MODELS[343])
    device = Echo()
    board.attach_spi(1, device)
    assert board.spi_exchange(1, 0x123456FF, 1) == 0
    assert board.spi_exchange(1, -1, 4) == 0
    assert board.spi_exchange(1, 0x12345678, 3) == 0x345679
    assert device.seen == [(0xFF, 1), (0xFFFFFFFF, 4), (0x345678, 3)]
    assert board.spi_exchange(0, 0x55, 1) == 0
    board.attach_spi(1, None)
    assert board.spi_exchange(1, 0x55, 1) == 0


def test_each_driver_gets_its_own_word_and_answers_in_its_own_place():
    board = powered(343)
    drivers = [Tmc246() for _ in range(3)]
    for motor, driver in enumerate(drivers):
        board.attach_driver(motor, driver)
        driver.set_fault("temperature_warning", motor == 1)
    assert board.driver_statuses() >> 12 & 0xFFF == drivers[1].status()
    assert board.driver_statuses() & 0xFFF == drivers[2].status() == drivers[0].status()
    assert drivers[1].status() & 0xFF == 0x40
    # At index 0 of the sine table coil A is off and coil B carries everything.
    assert [driver.current_codes for driver in drivers] == [(0, 15)] * 3


@pytest.mark.parametrize("number", MODELS)
def test_what_is_not_connected_is_low(number):
    board = powered(number)
    assert (board.digital_inputs(), board.shutdown_level()) == (0, 0)
    assert not any(board.switch(motor, side) for motor in range(3) for side in ("left", "right"))


def test_without_drivers_the_chain_reads_no_load_and_no_error():
    assert Board(MODELS[343]).driver_statuses() == QUIET_DRIVER << 24 | QUIET_DRIVER << 12 | QUIET_DRIVER
    assert Board(MODELS[342]).driver_statuses() == 0


@pytest.mark.parametrize("number", MODELS)
def test_a_board_at_rest_has_no_events_and_reset_keeps_time_and_pins(number):
    board = powered(number)
    board.set_switch(2, "right", True)
    board.set_outputs(3)
    run_until(board, HZ)
    assert (board.now, board.next_event()) == (HZ, NEVER)
    board.reset()
    assert (board.now, board.outputs, board.switch(2, "right")) == (HZ, 0, True)
