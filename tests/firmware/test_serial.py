from __future__ import annotations

from itertools import pairwise

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from firmware.hosts import Host, switched_on
from tmcm34x.clock import MS, run_until
from tmcm34x.firmware.ports.serial import TIME_OUT, SerialPort
from tmcm34x.tmcl.datagram import Instruction, pack_request
from tmcm34x.tmcl.global_parameters import BAUD_RATES

GET_SPEED = pack_request(1, Instruction(6, 4, 0))
ANSWER = bytes.fromhex("0201 6406 0000 03e8 58")


def wired(**options):
    """A module and a port, with what the port has sent so far."""
    module = switched_on()
    sent: list[bytes] = []
    return module, SerialPort(module, sent.append, **options), sent


def test_a_telegram_is_answered_at_once():
    _, port, sent = wired()
    port.receive(GET_SPEED)
    assert sent == [ANSWER]


@settings(max_examples=50)
@given(st.integers(1, 6), st.lists(st.integers(1, 53), max_size=8))
def test_telegrams_may_come_in_any_pieces(count, cuts):
    _, port, sent = wired()
    stream = GET_SPEED * count
    places = sorted({0, len(stream), *(cut for cut in cuts if cut < len(stream))})
    for start, end in pairwise(places):
        port.receive(stream[start:end])
    assert sent == [ANSWER] * count


@pytest.mark.parametrize(("pause", "answers"), [(TIME_OUT, 1), (TIME_OUT + 1, 0)])
def test_a_telegram_that_pauses_too_long_is_dropped(pause, answers):
    module, port, sent = wired()
    port.receive(GET_SPEED[:4])
    run_until(module, pause)
    port.receive(GET_SPEED[4:])
    assert len(sent) == answers
    run_until(module, module.now + TIME_OUT + 1)
    port.receive(GET_SPEED)
    assert len(sent) == answers + 1


def test_the_time_out_belongs_to_the_port():
    module, port, sent = wired()
    port.time_out = 100 * MS
    port.receive(GET_SPEED[:4])
    run_until(module, 100 * MS)
    port.receive(GET_SPEED[4:])
    assert sent == [ANSWER]


def test_another_address_is_silence_whatever_its_checksum():
    _, port, sent = wired()
    port.receive(pack_request(2, Instruction(6, 4, 0)))
    port.receive(bytes(9))
    port.receive(b"\x00" + bytes(7) + b"\x55")
    assert sent == []


def test_a_wrong_checksum_is_answered_with_nothing_but_the_status():
    module, port, sent = wired()
    port.receive(pack_request(1, Instruction(5, 4, 0, 7))[:8] + b"\x00")
    assert sent == [bytes.fromhex("0201 0100 0000 0000 04")]
    assert module.axes[0].values[4] == 1000


def test_a_port_for_any_address_answers_with_the_module_s_own():
    _, port, sent = wired(any_address=True)
    port.receive(pack_request(0, Instruction(6, 4, 0)))
    assert sent == [ANSWER]


def test_a_new_address_holds_after_the_reply():
    _, port, sent = wired()
    port.receive(pack_request(1, Instruction(9, 66, 0, 7)))
    port.receive(pack_request(1, Instruction(6, 4, 0)))
    port.receive(pack_request(7, Instruction(9, 76, 0, 5)))
    port.receive(pack_request(7, Instruction(6, 4, 0)))
    assert [(reply[0], reply[1]) for reply in sent] == [(2, 1), (2, 7), (5, 7)]


def test_a_new_baud_rate_holds_after_the_reply():
    module, _, _ = wired()
    rates = []
    port = SerialPort(module, lambda _: rates.append(port.baud_rate))
    assert port.baud_rate == BAUD_RATES[0] == 9600
    port.receive(pack_request(1, Instruction(9, 65, 0, 7)))
    assert (rates, port.baud_rate) == ([9600], 115200)
    port.receive(pack_request(1, Instruction(9, 75, 0, 10)))
    port.receive(pack_request(1, Instruction(9, 65, 0, 0)))
    assert port.baud_rate == 115200
    run_until(module, 20 * MS)
    assert (rates, port.baud_rate) == ([9600, 115200, 115200], 9600)
    module.reset()
    assert port.baud_rate == 9600


def test_replies_keep_their_order_through_the_telegram_pause():
    module = switched_on()
    seen = []
    port = SerialPort(module, lambda data: seen.append((module.now, data[7])))
    port.receive(pack_request(1, Instruction(9, 75, 0, 15)))
    run_until(module, 5 * MS)
    port.receive(pack_request(1, Instruction(9, 0, 2, 1)))
    port.receive(pack_request(1, Instruction(9, 75, 0, 2)))
    run_until(module, 6 * MS)
    port.receive(pack_request(1, Instruction(9, 75, 0, 0)))
    run_until(module, 40 * MS)
    port.receive(pack_request(1, Instruction(9, 0, 2, 3)))
    assert seen == [(15 * MS, 15), (20 * MS, 1), (20 * MS, 2), (20 * MS, 0), (40 * MS, 3)]


def test_the_pause_holds_back_the_second_reply_of_138_too():
    module = switched_on()
    seen = []
    port = SerialPort(module, lambda data: seen.append((module.now, data[2])))
    module.eeprom.set_global_value(75, 10)
    module.take_settings()
    port.receive(pack_request(1, Instruction(138, 0, 0, 7)))
    run_until(module, 50 * MS)
    assert seen == [(10 * MS, 100), (10 * MS, 128)]


def test_138_for_no_motor_is_answered_at_once():
    _, port, sent = wired()
    port.receive(pack_request(1, Instruction(138, 0, 0, 0)))
    assert [reply[2] for reply in sent] == [100, 128]


def test_disabled_replies_stay_away_until_they_are_enabled():
    module, port, sent = wired()
    for instruction in (
        Instruction(9, 255, 0, 1),
        Instruction(6, 4, 0),
        Instruction(99),
        Instruction(136),
        Instruction(138),
    ):
        port.receive(pack_request(1, instruction))
    port.receive(bytes((1, 2, 3, 4, 5, 6, 7, 8, 0)))
    assert sent == []
    port.receive(pack_request(1, Instruction(9, 255, 0, 0)))
    assert len(sent) == 1
    port.receive(pack_request(1, Instruction(9, 255, 0, 1)))
    module.reset()
    port.receive(pack_request(1, Instruction(6, 4, 0)))
    assert len(sent) == 2


def test_the_version_comes_as_nine_bytes_without_a_checksum():
    _, port, sent = wired()
    port.receive(pack_request(1, Instruction(136)))
    assert sent == [b"\x02343V4.36"]


def test_a_stored_command_comes_as_host_address_record_and_checksum():
    module, port, sent = wired()
    module.eeprom.write_instruction(5, Instruction(4, 0, 1, -2))
    port.receive(pack_request(1, Instruction(134, 0, 0, 5)))
    assert sent == [bytes.fromhex("02 04 00 01 ff ff ff fe 02")]


def test_139_is_answered_as_a_telegram_and_what_follows_is_text():
    _, port, sent = wired()
    port.receive(pack_request(1, Instruction(139)) + b"AGAP 4, 0\r")
    assert sent[0] == bytes.fromhex("0201 648b 0000 0000 f2")
    assert b"".join(sent[1:]) == b"AGAP 4, 0\rBA 100 1000\r"
    port.receive(b"ABIN\r" + GET_SPEED)
    assert sent[-1] == ANSWER
    assert not port.ascii_mode


def test_the_port_starts_in_ascii_mode_when_parameter_67_says_so():
    module, port, sent = wired()
    Host(module).do("SGP 67, 0, $21")
    assert not port.ascii_mode
    module.reset()
    assert port.ascii_mode
    port.receive(b"AGAP 4, 0\r")
    assert sent == [b"BA 100 1000\r"]
    assert SerialPort(module, sent.append).ascii_mode


def test_power_off_forgets_half_a_telegram_and_what_was_to_be_sent():
    module, port, sent = wired()
    port.receive(pack_request(1, Instruction(9, 75, 0, 10)))
    port.receive(GET_SPEED[:5])
    module.reset()
    port.receive(GET_SPEED[5:])
    run_until(module, 100 * MS)
    port.receive(GET_SPEED)
    run_until(module, 200 * MS)
    assert sent == [ANSWER]
