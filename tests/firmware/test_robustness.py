"""Bad input, and time cut into any slices."""

from __future__ import annotations

import random

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from firmware.hosts import Host, module_state, switched_on
from tmcm34x.clock import MS, run_until
from tmcm34x.firmware.ports.can import CanPort
from tmcm34x.firmware.ports.serial import TIME_OUT, SerialPort
from tmcm34x.tmcl.commands import COMMANDS, CONTROL_FUNCTIONS
from tmcm34x.tmcl.datagram import Instruction, checksum, pack_can_request, pack_request, unpack_reply

TELEGRAMS = 40_000
"""For each model."""
KNOWN = sorted(row.number for row in (*COMMANDS, *CONTROL_FUNCTIONS))
TYPES = (0, 1, 2, 3, 4, 5, 7, 8, 13, 64, 65, 73, 81, 84, 130, 132, 138, 149, 153, 154, 203, 205, 213, 255)
VALUES = (
    0, 1, -1, 2, 7, 20, 255, 500, 1000, 1234, 2047, 2048, 4321, -2047, 10_000, -50_000,
    2**23 - 1, -(2**23), 2**31 - 1, -(2**31),
)  # fmt: skip


def random_instruction(rng: random.Random) -> Instruction:
    number = rng.choice(KNOWN) if rng.random() < 0.8 else rng.randrange(256)
    type_ = rng.choice(TYPES) if rng.random() < 0.7 else rng.randrange(256)
    motor = rng.randrange(3) if rng.random() < 0.7 else rng.randrange(256)
    value = rng.choice(VALUES) if rng.random() < 0.7 else rng.randrange(-(2**31), 2**31)
    return Instruction(number, type_, motor, value)


def keeps_the_line(instruction: Instruction) -> bool:
    """Whether the command leaves address, replies and telegrams as they are, so that the next can be checked."""
    number, type_, motor, _ = instruction
    if number in {9, 35, 11, 12} and motor == 0 and type_ in {65, 66, 67, 75, 76, 255}:
        return False
    return number not in {139}


@pytest.mark.parametrize("model", [341, 342, 343])
def test_random_commands_are_answered_once_with_nine_bytes_each(model):
    rng = random.Random(model)
    module = switched_on(model)
    received: list[bytes] = []
    port = SerialPort(module, received.append)
    for _ in range(TELEGRAMS):
        instruction = random_instruction(rng)
        if not keeps_the_line(instruction):
            continue
        if rng.random() < 0.05:
            run_until(module, module.now + rng.randrange(30 * MS))
            received.clear()
        port.receive(pack_request(1, instruction))
        if instruction.number == 137 and not received:
            continue
        telegram = received[0]
        assert len(telegram) == 9, instruction
        assert all(unpack_reply(second).status == 128 for second in received[1:])
        if instruction.number not in {134, 136}:
            reply = unpack_reply(telegram)
            assert (reply.host, reply.address, reply.command) == (2, 1, instruction.number)
            assert reply.status in {2, 3, 4, 5, 6, 100, 101}, instruction
        received.clear()


def test_random_bytes_in_random_pieces_never_raise_and_never_get_a_torn_reply():
    rng = random.Random(7)
    module = switched_on()
    received: list[bytes] = []
    port = SerialPort(module, received.append, any_address=True)
    for _ in range(20_000):
        telegram = pack_request(1, random_instruction(rng))
        kind = rng.random()
        if kind < 0.2:
            telegram = telegram[: rng.randrange(9)]
        elif kind < 0.4:
            telegram = rng.randbytes(rng.randrange(30))
        elif kind < 0.5:
            telegram += pack_request(rng.randrange(256), random_instruction(rng))
        port.receive(telegram)
        if not port.ascii_mode:
            assert all(len(reply) in {9} for reply in received)
        port.enter_text(False)
        received.clear()
        if rng.random() < 0.1:
            run_until(module, module.now + rng.randrange(20 * MS))
            received.clear()
        if rng.random() < 0.01:
            module.reset()
            received.clear()


def test_random_can_frames_are_answered_with_as_many_bytes():
    rng = random.Random(8)
    module = switched_on()
    received: list[tuple[int, bytes]] = []
    port = CanPort(module, lambda identifier, data: received.append((identifier, data)))
    for _ in range(10_000):
        instruction = random_instruction(rng)
        if instruction.number in {9, 35} and instruction.motor == 0 and instruction.type in {70, 71, 83, 255}:
            continue
        size = rng.choice((7, 8))
        port.receive_frame(1, pack_can_request(instruction, size))
        if instruction.number != 137 or received:
            assert {(identifier, len(data)) for identifier, data in received} == {(2, size)}, instruction
        received.clear()


def test_a_refused_command_changes_nothing():
    rng = random.Random(9)
    module = switched_on()
    host = Host(module)
    refused = 0
    before = module_state(module)
    for _ in range(6_000):
        instruction = random_instruction(rng)
        if not keeps_the_line(instruction) or instruction.number in {132, 129, 130}:
            continue
        host.send(*instruction)
        if instruction.number in {134, 136, 137}:
            host.received.clear()
            before = module_state(module)
            continue
        status = host.replies()[0].status
        if status < 100:
            refused += 1
            assert module_state(module) == before, instruction
        elif instruction.number not in {6, 15, 31}:
            before = module_state(module)
    assert refused > 1000


@settings(max_examples=60)
@given(
    st.lists(st.binary(min_size=1, max_size=24), max_size=6),
    st.lists(st.integers(0, 4 * TIME_OUT), min_size=6, max_size=6),
)
def test_after_any_noise_and_a_pause_a_telegram_is_understood(chunks, pauses):
    module = switched_on()
    received: list[bytes] = []
    port = SerialPort(module, received.append)
    for chunk, pause in zip(chunks, pauses, strict=False):
        port.receive(bytes(byte if byte != 1 else 0 for byte in chunk))
        run_until(module, module.now + pause)
    run_until(module, module.now + TIME_OUT + 1)
    received.clear()
    port.receive(pack_request(1, Instruction(6, 4, 0)))
    assert [unpack_reply(reply).value for reply in received] == [1000]


@given(st.integers(0, 8), st.integers(1, 255))
def test_one_wrong_byte_is_answered_with_status_1_or_not_at_all(index, error):
    module = switched_on()
    received: list[bytes] = []
    telegram = bytearray(pack_request(1, Instruction(5, 4, 0, 500)))
    telegram[index] = telegram[index] + error & 0xFF
    SerialPort(module, received.append).receive(bytes(telegram))
    wrong = bytes((2, 1, 1, 0, 0, 0, 0, 0))
    expected = [] if index == 0 else [wrong + bytes((checksum(wrong),))]
    assert received == expected
    assert module.axes[0].values[4] == 1000


# Slicing


def moving_instruction(rng: random.Random) -> Instruction:
    """Commands that make motors move and supervision work."""
    motor = rng.randrange(3)
    return rng.choice(
        (
            Instruction(1, 0, motor, rng.randint(-2047, 2047)),
            Instruction(2, 0, motor, rng.randint(-2047, 2047)),
            Instruction(3, 0, motor),
            Instruction(4, 0, motor, rng.randint(-20_000, 20_000)),
            Instruction(4, 1, motor, rng.randint(-3_000, 3_000)),
            Instruction(4, 2, 0x47, 0),
            Instruction(30, 0, motor, rng.randint(-20_000, 20_000)),
            Instruction(5, 4, motor, rng.randint(0, 2047)),
            Instruction(5, 5, motor, rng.randint(0, 2047)),
            Instruction(5, 1, motor, rng.randint(-5_000, 5_000)),
            Instruction(5, 3, motor, rng.randint(-500, 500)),
            Instruction(5, rng.choice((204, 214)), motor, rng.randint(1, 20)),
            Instruction(5, 203, motor, rng.randint(-1, 1500)),
            Instruction(5, 211, motor, rng.randint(0, 1500)),
            Instruction(5, 205, motor, rng.choice((0, 0, 7))),
            Instruction(5, 153, motor, rng.randint(2, 9)),
            Instruction(5, 154, motor, rng.randint(2, 7)),
            Instruction(9, 68, 0, rng.choice((0, 20, 150))),
            Instruction(9, 75, 0, rng.choice((0, 3, 15))),
            Instruction(9, 80, 0, rng.randint(0, 2)),
            Instruction(5, 213, motor, rng.choice((0, 0, 1))),
            Instruction(138, 0, 0, rng.randrange(8)),
            Instruction(13, rng.randrange(2), motor),
            Instruction(6, rng.choice((1, 2, 3, 8, 135, 206)), motor),
        )
    )


def history(model: int, seed: int, slices: random.Random | None) -> tuple[list, list]:
    """Replies with their clocks and the states on the way, of a module driven by `seed` in any slices."""
    rng = random.Random(seed)
    module = switched_on(model)
    replies: list[tuple[int, bytes]] = []
    states: list[tuple] = []
    port = SerialPort(module, lambda data: replies.append((module.now, data)))
    for _ in range(25):
        port.receive(pack_request(1, moving_instruction(rng)))
        pin = rng.random()
        if pin < 0.2:
            module.board.set_switch(rng.randrange(3), rng.choice(("left", "right")), rng.random() < 0.5)
        elif pin < 0.25:
            module.board.set_shutdown(rng.randrange(2))
        until = module.now + rng.choice(
            (0, 1, rng.randrange(MS), rng.randrange(100 * MS), rng.randrange(800 * MS))
        )
        if slices is not None:
            for _ in range(slices.randrange(4)):
                run_until(module, slices.randint(module.now, until))
            while slices.random() < 0.5:
                module.advance(min(slices.randint(module.now, until), module.next_event()))
        run_until(module, until)
        states.append(module_state(module))
    return replies, states


@pytest.mark.parametrize("model", [341, 342, 343])
@settings(max_examples=40)
@given(seed=st.integers(0, 2**32), slicing=st.integers(0, 2**32))
def test_slicing_does_not_matter(model, seed, slicing):
    replies, states = history(model, seed, None)
    sliced_replies, sliced_states = history(model, seed, random.Random(slicing))
    assert sliced_replies == replies
    for state, sliced_state in zip(states, sliced_states, strict=True):
        assert sliced_state == state
