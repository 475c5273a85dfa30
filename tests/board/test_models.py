from __future__ import annotations

import pytest

from tmcm34x.board.models import CELLS, MICROSTEP_TABLE, MODELS


@pytest.mark.parametrize("model", MODELS.values())
def test_names_and_versions_agree(model):
    assert model.name == f"TMCM-{model.number}"
    assert model.version == f"{model.number}V4.36"
    assert model.binary_version.to_bytes(4, "big") == model.number.to_bytes(2, "big") + bytes((4, 36))


@pytest.mark.parametrize("model", MODELS.values())
def test_every_motor_has_a_place_in_a_chip_of_its_own(model):
    assert len(set(model.wiring)) == 3
    assert {chip for chip, _ in model.wiring} == set(range(len(model.parts)))


@pytest.mark.parametrize("model", MODELS.values())
def test_the_driver_chain_ends_after_the_last_driver(model):
    assert len(model.driver_chain) == CELLS
    drivers = len(model.wiring) // len(model.parts)
    assert sum(cell >> 5 for cell in model.driver_chain) == drivers


def test_shutdown_has_its_pin():
    assert [MODELS[number].shutdown_pin for number in (341, 342, 343)] == [32, 43, 44]


def test_the_microstep_table_is_a_quarter_of_a_sine():
    assert list(MICROSTEP_TABLE[:8]) == [0, 2, 3, 5, 6, 8, 9, 11]
    assert set(MICROSTEP_TABLE[-8:]) == {63}
    assert list(MICROSTEP_TABLE) == sorted(MICROSTEP_TABLE)
