"""SPI devices."""

from tmcm34x.world.device import Buttons, Echo, ShiftRegister


def test_an_echo_returns_what_is_sent():
    assert Echo().exchange(0x1234, 2) == 0x1234


def test_a_shift_register_returns_what_was_sent_before():
    chain = ShiftRegister(2)
    assert chain.exchange(0xAABB, 2) == 0
    assert chain.latched == 0xAABB
    assert chain.exchange(0xCC, 1) == 0xAA
    assert chain.latched == 0xBBCC
    assert chain.exchange(0x1122_3344, 4) == 0xBBCC_1122
    assert chain.latched == 0x3344


def test_buttons_come_first_then_what_is_shifted_in():
    buttons = Buttons(2, 0xBEEF)
    assert buttons.exchange(0, 1) == 0xBE
    assert buttons.exchange(0, 2) == 0xBEEF
    assert buttons.exchange(0x11223344, 4) == 0xBEEF1122
