"""Every row of docs/conformance.md is pinned, and every pin has a row."""

import conformance
import pytest

PINS = conformance.all_pins()


@pytest.mark.parametrize("row", conformance.ROWS.values(), ids=lambda row: row.key)
def test_a_row_is_pinned_on_all_three_models(row):
    pins = PINS.get(row.key, [])
    assert pins, f"nothing pins {row.key}, {row.name}"
    assert frozenset().union(*(pin.models for pin in pins)) >= row.models


def test_a_pin_names_a_row():
    unknown = {
        f"{pin.where}: {key}" for key, pins in PINS.items() if key not in conformance.ROWS for pin in pins
    }
    assert not unknown


def test_a_row_has_one_key():
    keys = [row.key for rows in conformance.GROUPS.values() for row in rows()]
    assert len(keys) == len(set(keys))


def test_ranges_of_numbers_are_spelled_out():
    assert conformance.expand("AP.4..6 ROR") == ["AP.4", "AP.5", "AP.6", "ROR"]
    assert conformance.expand("GP.7..22") == ["GP.7..22"]


def test_the_page_is_fresh():
    assert (conformance.TESTS.parent / "docs" / "conformance.md").read_text() == conformance.page()


@pytest.mark.parametrize("key", conformance.ROWS)
def test_each_row_says_where_it_is_implemented(key):
    file, _, functions = conformance.implemented(key).partition(" ")
    text = (conformance.SOURCE / file).read_text()
    for name in functions.replace("`", "").split(", ") if functions else ():
        assert f"def {name}(" in text
