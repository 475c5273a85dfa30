"""The register map and its datagrams."""

from itertools import combinations

import pytest

from tmcm34x.chips import registers
from tmcm34x.chips.registers import BY_NAME, COMMON, FIELDS, MOTOR, REGISTERS, sign_extended


def test_first_byte_is_area_index_and_direction():
    # Stated by the datasheet for the common registers and used by the vendor's firmware for the motors.
    assert BY_NAME["SMGP"].write(0) >> 24 == 0x7E
    assert BY_NAME["TYPE_VERSION"].read() >> 24 == 0x73
    assert BY_NAME["X_TARGET"].write(0, motor=2) >> 24 == 0x40
    assert BY_NAME["V_ACTUAL"].read(1) >> 24 == 0x2B
    assert registers.write_ram(32, 0, 2) == 0x80 + 2 * 32 << 24 | 0x0200
    assert registers.read_ram(0) == 0x81000000


def test_no_two_registers_share_an_address_and_no_two_fields_share_bits_or_a_name():
    assert len({(register.area, register.index) for register in REGISTERS}) == len(REGISTERS)
    assert sum(len(register.fields) for register in REGISTERS) == len(FIELDS)
    for register in REGISTERS:
        for one, other in combinations(register.fields, 2):
            assert one.mask & other.mask == 0, register.name


def test_every_motor_register_has_its_row():
    assert [register.index for register in REGISTERS if register.area == MOTOR] == list(range(16))
    assert {register.index for register in REGISTERS if register.area == COMMON} == {*range(7), 8, 9, 14, 15}


@pytest.mark.parametrize("name", sorted(FIELDS))
def test_fields_keep_what_is_put_into_them_and_leave_the_rest(name):
    _, field = FIELDS[name]
    lowest = -1 << field.width - 1 if field.signed else 0
    for value in (lowest, lowest + 1, lowest + (1 << field.width) - 1):
        for data in (0, 0xFFFFFF):
            packed = field.put(data, value)
            assert field.get(packed) == value
            assert (packed ^ data) & ~field.mask == 0


def test_sign_extension_covers_both_ends():
    assert [sign_extended(value, 12) for value in (0, 0x7FF, 0x800, 0xFFF, 0x1FFF)] == [
        0,
        2047,
        -2048,
        -1,
        -1,
    ]
