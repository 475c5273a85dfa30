"""Settings as text, both ways, and into a module."""

import pytest
from hypothesis import given
from hypothesis import settings as hypothesis_settings
from hypothesis import strategies as st

from host_rigs import connected, faulty, module_of
from tmcm34x.bench import simple_rig
from tmcm34x.host import FileError, Module, RefusedError, settings
from tmcm34x.host.items import COMMUNICATION, GUARDED, settings_items
from tmcm34x.host.reading import Absent, Refused, Silent, Value
from tmcm34x.host.settings import from_text, to_tmcl, to_toml
from tmcm34x.tmcl.global_parameters import BY_KEY
from tmcm34x.toolchain.assembler import assemble
from tmcm34x.toolchain.linter import lint

VERSION = "343V4.36"


@hypothesis_settings(max_examples=30)
@given(st.sampled_from([341, 342, 343]), st.data())
def test_both_forms_give_the_same_values_back(model, data):
    items = settings_items(model)
    chosen = data.draw(st.lists(st.sampled_from(items), min_size=1, unique=True))
    readings = {
        item: Value(data.draw(st.integers(item.low, min(item.high, item.low + 7)))) for item in chosen
    }
    values = {item: reading.value for item, reading in readings.items()}
    kept = {item: n for item, n in values.items() if n or item.table not in {"variables", "coordinates"}}
    if not kept:
        return
    tmcl = from_text(to_tmcl(model, VERSION, readings), model)
    assert tmcl.values == kept
    assert tmcl.model == model
    if not any(item.table == "coordinates" for item in kept):
        assert from_text(to_toml(model, VERSION, readings), model).values == kept


def test_the_tmcl_form_looks_like_the_vendors_export():
    text = to_tmcl(343, VERSION, dict.fromkeys(settings_items(343), Value(1)))
    assert text.startswith("// Settings of a TMCM-343, firmware 343V4.36\n")
    assert "//=== module settings for axis 2 ===" in text
    assert "SAP 4, 2, 1             \t// maximum positioning speed [velocity units]" in text


def test_divisors_come_before_what_they_are_the_unit_of():
    text = to_tmcl(343, VERSION, dict.fromkeys(settings_items(343), Value(1)))
    assert "W312" not in {item.code for item in lint(assemble(text))}


def test_an_export_of_the_vendor_begins_with_a_heading_or_a_command():
    for head in ("//=== module settings for axis 0 ===\n", "SAP 5, 0, 9 // a = 9\n"):
        found = from_text(head + "SAP 4, 0, 500\t// maximum speed [int]\nSAP 181, 0, 5\n", 343)
        assert ("axis.0.max_speed", 500) in [(item.path, number) for item, number in found.values.items()]
        assert found.skipped == ["SAP 181, 0, 5"]
    assert from_text("Fast = 900\nSAP 4, 0, Fast\n", 343, "export.TMC").values


def test_what_could_cut_the_line_or_wipe_the_program_is_left_alone_both_ways():
    left_out = {*COMMUNICATION, *GUARDED}
    assert not left_out & {item.key for item in settings_items(343)}
    program = "\n".join(f"SGP {BY_KEY[key].number}, 0, 1" for key in sorted(left_out))
    with pytest.raises(FileError, match="there are no settings"):
        from_text(program, 343)
    found = from_text(program + "\nSAP 4, 0, 5", 343)
    assert [(item.path, number) for item, number in found.values.items()] == [("axis.0.max_speed", 5)]
    assert len(found.skipped) == len(left_out)


def test_what_the_module_does_not_have_is_skipped_and_named():
    found = from_text("[axis.0]\nmax_current = 3\nmax_speed = 4\n", 342)
    assert [item.path for item in found.values] == ["axis.0.max_speed"]
    assert found.skipped == ["axis.0.max_current"]


def test_what_was_not_read_is_said_and_no_value():
    items = settings_items(343)
    readings = dict.fromkeys(items, Value(1))
    readings[items[0]], readings[items[1]], readings[items[2]] = (
        Silent("the line is bad"),
        Refused(3),
        Absent("a 342"),
    )
    for write in (to_toml, to_tmcl):
        text = write(343, VERSION, readings)
        assert "INCOMPLETE settings (3 could not be read, see the end)" in text.splitlines()[0]
        assert f"{items[0].path}: no reply: the line is bad" in text
        assert f"{items[1].path}: refused: status 3, wrong type" in text
        assert items[0] not in from_text(text, 343).values


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "there are no settings"),
        ("ROR 0, 1", "settings:1: only SAP, SGP and SCO are settings"),
        ("SAP 4, 0", "settings:1: "),
        ("SAP 4, 0, 5000", "settings:1: axis.0.max_speed: must be 0..2047, not 5000"),
        ("# x\n[axis.0]\nnonsense = 1", "settings:3: axis.0.nonsense: there is no such name"),
        ("# x\n[axis.7]\nmax_speed = 1", "settings:2: axis.7: motors are"),
        ("# x\naxis = 3", "axis: must be a table"),
        ("# x\n[coordinates]\n3 = 4", "settings:3: coordinates.3: must be a list"),
        ("# x\n[coordinates]\n3 = [1, 2, 8388608]", "settings:3: coordinates.3: must be -8388608..8388607"),
        ("# x\n[variables]\nx = 1", "settings:3: variables.x"),
        ("# x\n[module]\nauto_start = 'on'", "settings:3: module.auto_start: must be a whole number"),
        ("[axis", "settings:1: not TOML"),
        ("\0", "settings"),
        ("# only", "there are no settings"),
    ],
)
def test_a_text_without_settings_is_refused_with_path_line_and_reason(text, message):
    with pytest.raises(FileError) as refused:
        from_text(text, 343)
    assert message in str(refused.value)


@pytest.mark.parametrize(
    "fault", ["garble,probability=0.08", "drop,probability=0.08", "wrong_address,probability=0.08"]
)
def test_an_export_over_a_bad_line_is_whole_and_an_import_too(fault):
    first, second = (connected(faults=faulty(fault, seed=n), retries=8) for n in (1, 2))
    module = Module(connected(first.line.rig))
    module.axes[1].max_speed = 321
    module.variables[7] = -9
    module.coordinates[5, 2] = 77
    readings = first.run(settings.read(settings_items(343)))
    found = from_text(to_toml(343, VERSION, readings), 343)
    assert second.run(settings.apply(found.values)) == []
    assert second.run(settings.store(settings_items(343))) == []
    assert module_of(second).eeprom.axis_values[1][4] == 321
    assert second.run(settings.read(settings_items(343))) == readings


def test_a_refusal_does_not_end_an_import_but_a_lock_ends_storing():
    connection = connected()
    module = Module(connection)
    module.eeprom_lock = 1234
    items = {item.path: item for item in settings_items(343)}
    wanted = {items["module.auto_start"]: 1, items["axis.0.max_speed"]: 55}
    (failure,) = connection.run(settings.apply(wanted))
    assert "status 5, configuration EEPROM locked: unlock it with SGP 73, 0, 4321" in failure.why
    assert module.axes[0].max_speed == 55
    with pytest.raises(RefusedError, match="unlock it with SGP 73, 0, 4321"):
        connection.run(settings.store(settings_items(343)))


def test_divisors_are_set_before_what_depends_on_them():
    found = from_text("SAP 5, 0, 10\nSAP 153, 0, 9\nSAP 4, 0, 100\nSAP 154, 0, 5", 343)
    keys = [item.key for item, _ in settings.in_order(found.values.items())]
    assert keys == ["ramp_divisor", "pulse_divisor", "max_acceleration", "max_speed"]


def test_models_keep_what_their_tables_say():
    assert {item.key for item in settings_items(343)} - {item.key for item in settings_items(342)} >= {
        "max_current"
    }
    assert len(connected(simple_rig(342)).run(settings.read(settings_items(342)))) == len(settings_items(342))


def test_a_module_that_stops_replying_is_not_asked_for_each_setting():
    connection = connected()

    def cut(done, _):
        if done == 10:
            module_of(connection).power_off()

    start, items = connection.line.now(), settings_items(343)
    readings = connection.run(settings.read(items, cut))
    assert connection.line.now() - start < 30
    assert [item for item in items if isinstance(readings[item], Value)] == list(items[:10])
    assert readings[items[-1]].text.endswith("not asked, because the module had stopped replying")
    assert to_toml(343, VERSION, readings).startswith("# INCOMPLETE settings")
