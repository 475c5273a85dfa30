from __future__ import annotations

import struct
import zlib

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tmcm34x.board.models import MODELS
from tmcm34x.firmware.storage import STORED_AXIS_PARAMETERS, STORED_GLOBAL_PARAMETERS, Eeprom, EepromError
from tmcm34x.tmcl.datagram import Instruction


def filled(model: int, seed: int) -> Eeprom:
    """A memory in which hardly anything is as delivered."""
    eeprom = Eeprom(model)
    for row in STORED_AXIS_PARAMETERS[model]:
        for motor in range(3):
            span = row.high - row.low + 1
            eeprom.set_axis_value(motor, row.number, row.low + (seed * 7919 + motor * 31 + row.number) % span)
    for row in STORED_GLOBAL_PARAMETERS:
        eeprom.set_global_value(row.number, row.low + (seed + row.number) % (row.high - row.low + 1))
    for n in range(56):
        eeprom.set_variable(n, (seed * 99991 + n) % 2**32 - 2**31)
    for n in range(1, 21):
        eeprom.set_coordinate(n, n % 3, seed % 2**23 - n)
    eeprom.set_driver_chain(bytes((seed + n) % 64 for n in range(64)))
    eeprom.set_microstep_table(bytes((seed + 2 * n) % 64 for n in range(64)))
    for address in (0, 1, seed % 2048, 2047):
        eeprom.write_instruction(address, Instruction(seed % 256, 2, 3, -seed))
    return eeprom


@settings(max_examples=30, deadline=None)
@given(st.sampled_from(sorted(MODELS)), st.integers(0, 2**31 - 1))
def test_an_image_holds_everything(model, seed):
    image = filled(model, seed).to_bytes()
    again = Eeprom.from_bytes(image)
    assert again.to_bytes() == image
    assert (again.model, again.revision) == (model, 0)


def test_a_fresh_memory_is_as_delivered():
    eeprom = Eeprom(342)
    assert (eeprom.global_values[64], eeprom.global_values[66], eeprom.locked) == (0xE4, 1, False)
    assert 6 not in eeprom.axis_values[0]
    assert eeprom.driver_chain == MODELS[342].driver_chain
    assert eeprom.read_instruction(2047) == Instruction(0)
    assert eeprom.revision == 0


def test_every_write_counts():
    eeprom = Eeprom()
    writes = (
        lambda: eeprom.set_axis_value(0, 4, 5),
        lambda: eeprom.set_global_value(77, 1),
        lambda: eeprom.set_variable(3, 4),
        lambda: eeprom.set_coordinate(20, 2, 5),
        lambda: eeprom.set_driver_chain(bytes(64)),
        lambda: eeprom.set_microstep_table(bytes(64)),
        lambda: eeprom.write_instruction(9, Instruction(1)),
        eeprom.erase_program,
        eeprom.restore_defaults,
    )
    for count, write in enumerate(writes, 1):
        write()
        assert eeprom.revision == count


def test_defaults_leave_the_program():
    eeprom = filled(343, 5)
    program = bytes(eeprom.program)
    eeprom.restore_defaults()
    assert bytes(eeprom.program) == program
    eeprom.erase_program()
    assert eeprom.to_bytes() == Eeprom(343).to_bytes()


def test_a_whole_program_replaces_the_one_before():
    eeprom = filled(343, 5)
    eeprom.write_program([Instruction(28), Instruction(22, 0, 0, 1)])
    assert [eeprom.read_instruction(n).number for n in (0, 1, 2, 2047)] == [28, 22, 0, 0]
    with pytest.raises(ValueError, match="at most 2048"):
        eeprom.write_program([Instruction(28)] * 2049)


def sealed(image: bytes) -> bytes:
    return image[:-4] + struct.pack("<I", zlib.crc32(image[:-4]))


GOOD = Eeprom(343).to_bytes()


@pytest.mark.parametrize(
    ("image", "text"),
    [
        (b"", "not an EEPROM image"),
        (b"\x7fELF" + bytes(2000), "not an EEPROM image"),
        (GOOD[:10], "incomplete"),
        (GOOD[:-1], "bytes instead of"),
        (GOOD + b"\0", "bytes instead of"),
        (GOOD[:400] + bytes((GOOD[400] ^ 1,)) + GOOD[401:], "wrong CRC"),
        (GOOD[:4] + b"\x02\x00" + GOOD[6:], "format 2"),
        (sealed(GOOD[:6] + b"\x5e\x01" + GOOD[8:]), "unknown module type 350"),
        (sealed(GOOD[:12] + b"\xff" + GOOD[13:]), "incomplete|impossible"),
        (sealed(GOOD[:13] + b"\xc8" + GOOD[14:]), "impossible axis parameter 200"),
        (sealed(GOOD[:14] + b"\xff\xff\xff\x7f" + GOOD[18:]), "impossible axis parameter 4"),
    ],
)
def test_an_image_that_is_none_is_refused_in_one_line(image, text):
    with pytest.raises(EepromError, match=text) as error:
        Eeprom.from_bytes(image)
    assert "\n" not in str(error.value)


@pytest.mark.parametrize(
    ("spoil", "text"),
    [
        (lambda eeprom: eeprom.set_global_value(65, 12), "impossible global parameter 65 = 12"),
        (lambda eeprom: eeprom.set_coordinate(3, 0, 2**23), "impossible coordinate"),
        (lambda eeprom: eeprom.set_driver_chain(bytes(63) + b"\x40"), "impossible chip table"),
    ],
)
def test_an_image_with_an_impossible_value_is_refused(spoil, text):
    eeprom = Eeprom()
    spoil(eeprom)
    with pytest.raises(EepromError, match=text):
        Eeprom.from_bytes(eeprom.to_bytes())


def test_an_image_that_lacks_parameters_gets_their_defaults():
    eeprom = filled(343, 12345)
    for values in eeprom.axis_values:
        del values[214], values[203]
    del eeprom.global_values[85]
    again = Eeprom.from_bytes(eeprom.to_bytes())
    assert [values[214] for values in again.axis_values] == [200] * 3
    assert again.axis_values[0][4] == eeprom.axis_values[0][4]
    assert again.global_values[85] == 0


@settings(max_examples=200, deadline=None)
@given(st.data())
def test_no_damage_gets_through(data):
    index = data.draw(st.integers(0, len(GOOD) - 1))
    bit = data.draw(st.integers(0, 7))
    torn = GOOD[:index] + bytes((GOOD[index] ^ 1 << bit,)) + GOOD[index + 1 :]
    with pytest.raises(EepromError):
        Eeprom.from_bytes(torn)
    with pytest.raises(EepromError):
        Eeprom.from_bytes(GOOD[:index])
