from __future__ import annotations

import copy
import pickle
import struct
import zlib

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tmcm34x.board.models import MODELS
from tmcm34x.firmware.changes import ENTRY_SIZE, Cell, EepromWrite
from tmcm34x.firmware.storage import FORMAT, Eeprom, EepromError, begin_journal, without_unfinished
from tmcm34x.tmcl.axis_parameters import axis_rows
from tmcm34x.tmcl.datagram import Instruction
from tmcm34x.tmcl.global_parameters import global_rows


def filled(model: int, seed: int, profile: str = "standard") -> Eeprom:
    """A memory in which hardly anything is as delivered."""
    eeprom = Eeprom(model, profile)
    for row in (row for row in axis_rows(model, profile) if row.stored):
        for motor in range(3):
            span = row.high - row.low + 1
            eeprom.set_axis_value(motor, row.number, row.low + (seed * 7919 + motor * 31 + row.number) % span)
    for row in (row for row in global_rows(profile) if row.stored):
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


@settings(max_examples=30)
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


WRITES = {
    Cell.AXIS_PARAMETER: lambda eeprom: eeprom.set_axis_value(2, 4, 5),
    Cell.GLOBAL_PARAMETER: lambda eeprom: eeprom.set_global_value(77, 1),
    Cell.USER_VARIABLE: lambda eeprom: eeprom.set_variable(3, -(2**31)),
    Cell.COORDINATE: lambda eeprom: eeprom.set_coordinate(20, 2, -5),
    Cell.DRIVER_CHAIN: lambda eeprom: eeprom.set_driver_chain(bytes(range(64))),
    Cell.MICROSTEP_TABLE: lambda eeprom: eeprom.set_microstep_table(bytes(range(63, -1, -1))),
    Cell.INSTRUCTION: lambda eeprom: eeprom.write_instruction(2047, Instruction(255, 254, 253, -(2**31))),
    Cell.PROGRAM_ERASED: Eeprom.erase_program,
    Cell.DEFAULTS: Eeprom.restore_defaults,
}


def test_every_write_counts():
    eeprom = Eeprom()
    for count, write in enumerate(WRITES.values(), 1):
        write(eeprom)
        assert eeprom.revision == count


def with_journal(eeprom, *cells):
    """Image and journal of a memory in which some cells are written."""
    image = eeprom.to_bytes()
    chain, journal = begin_journal(image), bytearray()

    def note(changes):
        journal.extend(chain.seal(changes))

    eeprom.listeners.append(note)
    for cell in cells:
        WRITES[cell](eeprom)
    return image + journal


@pytest.mark.parametrize("cell", Cell, ids=lambda cell: cell.name)
def test_a_journal_repeats_each_kind_of_write(cell):
    eeprom = filled(343, 77)
    before = eeprom.to_bytes()
    data = with_journal(eeprom, cell)
    assert eeprom.to_bytes() != before
    assert Eeprom.from_bytes(data).to_bytes() == eeprom.to_bytes()


def test_a_listener_gets_what_was_written():
    eeprom, changes = Eeprom(), []
    eeprom.listeners.append(changes.append)
    eeprom.set_variable(3, 4)
    eeprom.set_driver_chain(bytes(64))
    assert changes[0] == (EepromWrite(Cell.USER_VARIABLE, 0, 3, 4),)
    assert len(changes[1]) == 8


@pytest.mark.parametrize("copied", [copy.copy, copy.deepcopy, lambda each: pickle.loads(pickle.dumps(each))])
def test_a_copy_has_no_listeners(copied):
    eeprom, changes = filled(341, 9), []
    eeprom.listeners.append(changes.append)
    other = copied(eeprom)
    other.set_variable(3, 4)
    assert not changes
    assert other.model == 341


JOURNAL = with_journal(Eeprom(343), *Cell, *Cell)
IMAGE_SIZE = len(Eeprom(343).to_bytes())


@settings(max_examples=500)
@given(st.integers(IMAGE_SIZE - 8, len(JOURNAL) - 1), st.integers(1, 255))
def test_no_damage_of_a_journal_gets_through(index, mask):
    damaged = JOURNAL[:index] + bytes((JOURNAL[index] ^ mask,)) + JOURNAL[index + 1 :]
    with pytest.raises(EepromError, match=r"damaged: wrong CRC") as error:
        Eeprom.from_bytes(without_unfinished(damaged))
    assert "\n" not in str(error.value)


@pytest.mark.parametrize("first", range(5))
def test_an_entry_that_is_missing_or_in_another_place_is_found(first):
    start = IMAGE_SIZE + first * ENTRY_SIZE
    one, two, rest = (
        JOURNAL[start : start + ENTRY_SIZE],
        JOURNAL[start + ENTRY_SIZE : start + 2 * ENTRY_SIZE],
        JOURNAL[start + 2 * ENTRY_SIZE :],
    )
    for changed in (two + rest, two + one + rest, one + one + two + rest):
        with pytest.raises(EepromError, match=f"journal entry {first + 1}|journal entry {first + 2}"):
            Eeprom.from_bytes(JOURNAL[:start] + changed)


def test_a_journal_of_another_image_is_found():
    with pytest.raises(EepromError, match="journal entry 1"):
        Eeprom.from_bytes(Eeprom(342).to_bytes() + JOURNAL[IMAGE_SIZE:])


@pytest.mark.parametrize("cut", range(1, 2 * ENTRY_SIZE))
def test_entries_that_were_never_finished_are_left_out(cut):
    """What a power failure leaves: a piece of an entry, or a file that was made longer and not filled."""
    torn = JOURNAL[:-cut]
    whole = without_unfinished(torn)
    assert whole == JOURNAL[: len(JOURNAL) - -(-cut // ENTRY_SIZE) * ENTRY_SIZE]
    Eeprom.from_bytes(whole)
    assert without_unfinished(whole + bytes(cut)) == whole
    assert without_unfinished(JOURNAL + bytes(cut)) == JOURNAL


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
        (GOOD + b"\0", "1 bytes too many"),
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


@settings(max_examples=200)
@given(st.data())
def test_no_damage_gets_through(data):
    index = data.draw(st.integers(0, len(GOOD) - 1))
    bit = data.draw(st.integers(0, 7))
    torn = GOOD[:index] + bytes((GOOD[index] ^ 1 << bit,)) + GOOD[index + 1 :]
    with pytest.raises(EepromError):
        Eeprom.from_bytes(torn)
    with pytest.raises(EepromError):
        Eeprom.from_bytes(GOOD[:index])


def test_an_image_whose_body_ends_too_early_is_refused_though_its_checksum_is_right():
    head_and_body = struct.pack("<4sHHI", b"T34X", FORMAT, 343, 1) + b"\x05"
    with pytest.raises(EepromError, match="incomplete"):
        Eeprom.from_bytes(head_and_body + struct.pack("<I", zlib.crc32(head_and_body)))
