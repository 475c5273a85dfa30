"""Program images as files."""

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tmcm34x.tmcl.commands import PROGRAM_SIZE
from tmcm34x.tmcl.datagram import Instruction
from tmcm34x.toolchain.image import ImageError, pack_binary, pack_hex, unpack_binary, unpack_hex

BYTE = st.integers(0, 255)
INSTRUCTIONS = st.builds(Instruction, BYTE, BYTE, BYTE, st.integers(-(2**31), 2**31 - 1))
PROGRAM = (Instruction(4, 0, 1, 90000), Instruction(22))


def test_a_record_is_opcode_type_motor_value_and_sum():
    assert pack_binary(PROGRAM) == bytes.fromhex("04 00 01 00 01 5f 90 f5  16 00 00 00 00 00 00 16")


def test_a_hex_file_holds_the_same_bytes():
    assert pack_hex(PROGRAM) == ":100000000400010001 5F90F51600000000000016DA\n:00000001FF\n".replace(" ", "")


@given(st.lists(INSTRUCTIONS, max_size=40))
@settings(max_examples=50)
def test_both_forms_give_back_what_they_took(program):
    assert unpack_binary(pack_binary(program)) == tuple(program)
    assert unpack_hex(pack_hex(program)) == tuple(program)


def test_a_full_memory_fits_and_one_instruction_more_does_not():
    assert len(unpack_binary(pack_binary(PROGRAM[:1] * PROGRAM_SIZE))) == PROGRAM_SIZE
    with pytest.raises(ImageError, match="16384"):
        unpack_binary(pack_binary(PROGRAM[:1] * (PROGRAM_SIZE + 1)))


@pytest.mark.parametrize(
    ("data", "text"),
    [
        (b"\x16\0\0\0\0\0\0\x16\x1c\0\0", "offset 8: truncated, 3 of 8 bytes"),
        (b"\x16\0\0\0\0\0\0\x16\x1c\0\0\0\0\0\0\x1d", "offset 15: checksum 0x1d, expected 0x1c"),
    ],
)
def test_a_damaged_binary_file_is_refused_with_the_offset(data, text):
    with pytest.raises(ImageError, match=text):
        unpack_binary(data)


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("", "no end record"),
        (":0800000016000000000000", "line 1: checksum"),
        (":080000001600000000000016CC", "no end record"),
        (":080000001600000000000016CD\n:00000001FF", "line 1: checksum 0xcd, expected 0xcc"),
        (":070000001600000000000016CD\n:00000001FF", "line 1: 8 data bytes, 7 announced"),
        ("\nrubbish", "line 2: not an Intel HEX record"),
        (":080008001600000000000016C4\n:00000001FF", "offset 0: this byte is missing"),
        (":080000001600000000000016CC\n" * 2, "line 2: byte 0 is given twice"),
        (":020000040001F9", "line 1: address above 64 KB"),
        (":00000009F7", "line 1: record type 9"),
        (":0100000016E9\n:00000001FF", "offset 0: truncated, 1 of 8 bytes"),
    ],
)
def test_a_damaged_hex_file_is_refused_with_the_place(text, reason):
    with pytest.raises(ImageError, match=reason):
        unpack_hex(text)


def test_hex_records_may_come_in_any_order_and_with_start_addresses():
    first, second, end = pack_hex(PROGRAM * 2).split()
    assert (
        unpack_hex("\r\n".join([second, ":020000040000FA", ":0400000500000000F7", "", first, end]))
        == PROGRAM * 2
    )


@given(st.text(max_size=200) | st.text(":0123456789abcdef\n", max_size=200), st.binary(max_size=100))
@settings(max_examples=200)
def test_rubbish_is_an_image_or_an_image_error(text, data):
    for read in (lambda: unpack_hex(text), lambda: unpack_binary(data)):
        try:
            assert all(isinstance(instruction, Instruction) for instruction in read())
        except ImageError as error:
            assert str(error)
