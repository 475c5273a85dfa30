from __future__ import annotations

import copy

import pytest

from firmware.hosts import switched_on
from tmcm34x.clock import MS, run_until
from tmcm34x.firmware.ports.can import CanPort
from tmcm34x.tmcl.datagram import Instruction, pack_can_request


def wired(**settings):
    module = switched_on()
    for number, value in settings.items():
        module.eeprom.set_global_value(int(number[2:]), value)
    module.take_settings()
    sent: list[tuple[int, bytes]] = []
    return module, CanPort(module, lambda identifier, data: sent.append((identifier, data))), sent


@pytest.mark.parametrize("size", [7, 8])
def test_a_frame_is_answered_with_as_many_bytes(size):
    _, port, sent = wired()
    port.receive_frame(1, pack_can_request(Instruction(6, 4, 0), size))
    assert sent == [(2, bytes.fromhex("01 64 06 000003e8") + bytes(size - 7))]


@pytest.mark.parametrize("size", [0, 1, 6])
def test_frames_of_other_lengths_are_ignored(size):
    _, port, sent = wired()
    port.receive_frame(1, bytes(size))
    assert sent == []


def test_identifiers_are_those_of_parameters_70_71_and_83():
    _, port, sent = wired(gp70=0x321, gp71=0x7F5, gp83=0)
    for identifier in (0, 1, 0x7F5):
        port.receive_frame(identifier, pack_can_request(Instruction(6, 4, 0)))
    assert [(identifier, data[0]) for identifier, data in sent] == [(0x321, 0xF5)]
    module, port, sent = wired(gp83=0x55)
    for identifier in (1, 0x55):
        port.receive_frame(identifier, pack_can_request(Instruction(6, 4, 0)))
    assert len(sent) == 2
    module.execute(Instruction(9, 69, 0, 4))
    assert port.bit_rate == 125_000 - 25_000


def test_extended_frames_are_answered_like_standard_ones():
    _, port, sent = wired()
    port.receive_frame(1 << 31 | 1, pack_can_request(Instruction(6, 4, 0)))
    port.receive_frame(1 << 31 | 0x10000001, pack_can_request(Instruction(6, 4, 0)))
    assert sent == [(2, bytes.fromhex("01 64 06 000003e8"))]


@pytest.mark.parametrize(("size", "text"), [(7, b"343V4.3"), (8, b"343V4.36")])
def test_the_version_loses_its_last_character_in_seven_bytes(size, text):
    _, port, sent = wired()
    port.receive_frame(1, pack_can_request(Instruction(136), size))
    assert sent == [(2, text)]


def test_a_stored_command_fills_the_frame():
    module, port, sent = wired()
    module.eeprom.write_instruction(5, Instruction(4, 0, 1, -2))
    for size in (7, 8):
        port.receive_frame(1, pack_can_request(Instruction(134, 0, 0, 5), size))
    assert [data for _, data in sent] == [bytes.fromhex("040001fffffffe"), bytes.fromhex("040001fffffffe00")]


def test_pause_and_disabled_replies():
    module, port, sent = wired(gp75=100)
    port.receive_frame(1, pack_can_request(Instruction(6, 4, 0)))
    assert len(sent) == 1
    port.receive_frame(1, pack_can_request(Instruction(9, 255, 0, 1)))
    port.receive_frame(1, pack_can_request(Instruction(6, 4, 0)))
    assert len(sent) == 1
    assert not module.outbox


@pytest.mark.parametrize("size", [7, 8])
def test_the_second_reply_of_138_has_the_size_of_the_request(size):
    module, port, sent = wired()
    port.receive_frame(1, pack_can_request(Instruction(4, 0, 0, 100), size))
    port.receive_frame(1, pack_can_request(Instruction(138, 0, 0, 1), size))
    run_until(module, 500 * MS)
    assert [(data[1], data[2], len(data)) for _, data in sent] == [
        (100, 4, size),
        (100, 138, size),
        (128, 138, size),
    ]


def test_ascii_mode_is_not_for_can():
    _, port, sent = wired()
    port.receive_frame(1, pack_can_request(Instruction(139)))
    assert sent[0][1][1] == 6


def test_commands_on_can_do_not_feed_the_serial_heartbeat():
    module, port, _ = wired(gp68=100)
    port.receive_frame(1, pack_can_request(Instruction(1, 0, 0, 500)))
    run_until(module, 1000 * MS)
    assert module.execute(Instruction(6, 3, 0)) == (100, 500)


def test_a_module_switched_off_ignores_frames():
    module, port, sent = wired()
    module.power_off()
    port.receive_frame(1, pack_can_request(Instruction(6, 4, 0)))
    assert sent == []


class Observer:
    instruction = None

    def __init__(self):
        self.seen = []

    def telegram(self, port, direction, data, now):
        self.seen.append((direction, data[:3].hex()))

    def event(self, kind, motor, now):
        pass


def test_observers_see_frames_and_replies():
    module, port, sent = wired()
    observer = Observer()
    module.observers.append(observer)
    port.receive_frame(1, pack_can_request(Instruction(6, 4, 0)))
    assert observer.seen == [("in", "060400"), ("out", "016406")]
    assert len(sent) == 1


def test_the_port_of_a_copy_leads_nowhere():
    module, _, sent = wired()
    twin = copy.deepcopy(module)
    twin.ports[0].receive_frame(1, pack_can_request(Instruction(1, 0, 0, 500)))
    run_until(twin, 100 * MS)
    assert sent == []
    assert twin.execute(Instruction(6, 3, 0)) == (100, 500)
    assert module.execute(Instruction(6, 3, 0)) == (100, 0)


def test_a_port_that_is_detached_is_owed_nothing():
    module, port, sent = wired()
    port.receive_frame(1, pack_can_request(Instruction(4, 0, 0, 100)))
    port.receive_frame(1, pack_can_request(Instruction(138, 0, 0, 1)))
    sent.clear()
    assert module.owes_reply
    module.detach(port)
    assert not module.owes_reply
    run_until(module, module.now + 1000 * MS)
    assert sent == []


def test_replies_to_come_can_be_dropped():
    module, port, sent = wired()
    port.receive_frame(1, pack_can_request(Instruction(4, 0, 0, 100)))
    port.receive_frame(1, pack_can_request(Instruction(138, 0, 0, 1)))
    sent.clear()
    module.drop_replies()
    run_until(module, module.now + 1000 * MS)
    assert (sent, module.owes_reply) == ([], False)
