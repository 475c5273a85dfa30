import pytest

from tmcm34x.bench import simple_rig
from tmcm34x.clock import MS, run_until
from tmcm34x.debug.expressions import ExpressionError
from tmcm34x.debug.view import View
from tmcm34x.toolchain.assembler import assemble


@pytest.fixture
def rig():
    return simple_rig()


@pytest.fixture
def view(rig):
    return View.of(rig.modules[0], rig.worlds[0])


@pytest.mark.parametrize(
    ("target", "value"),
    [
        ("accumulator", -5),
        ("x", 2**31 - 1),
        ("counter", 2047),
        *((flag, on) for flag in ("zero", "eto", "eal", "edv", "epo", "esd") for on in (1, 0)),
        *((flag, on) for flag in ("equal", "lower", "greater") for on in (1, 0)),
        ("gp[55]", -(2**31)),
        ("gp[68][0]", 500),
        ("gp[serial_heartbeat][0]", 500),
        ("ap[4][2]", 77),
        ("ap[max_speed][1]", 78),
        ("co[0][1]", -3),
        ("co[20][2]", 4),
        ("out[7]", 1),
        ("out[255]", 170),
        ("in[3]", 1),
        ("adc[2]", 700),
        ("shutdown", 1),
        ("ACCUMULATOR", 3),
    ],
)
def test_what_is_written_reads_back(rig, view, target, value):
    assert view.assign(target, str(value)) in {value, 0}
    run_until(rig, MS)
    assert view.evaluate(target) == value


@pytest.mark.parametrize(
    ("target", "value", "text"),
    [
        ("ap[4][0]", "5000", "invalid value"),
        ("ap[8][0]", "1", "wrong type"),
        ("ap[99][0]", "1", "wrong type"),
        ("ap[4][3]", "1", "invalid value"),
        ("gp[56]", "1", "wrong type"),
        ("gp[0][1]", "1", "invalid value"),
        ("co[21][0]", "1", "status"),
        ("co[1][255]", "1", "motors are 0 to 2"),
        ("out[8]", "1", "wrong type"),
        ("in[8]", "1", "inputs are 0 to 7"),
        ("in[0]", "2", "in is 0 to 1"),
        ("in", "1", "takes 1 index"),
        ("ap[1]", "1", "takes 2 indices"),
        ("ap[300][0]", "1", "300 is not"),
        ("gp[1]", "1 << 31", "32 bits"),
        ("counter", "2048", "addresses are"),
        ("depth", "1", "0 to 0"),
        ("time_ms", "1", "cannot be set"),
        ("nobody", "1", "nothing can be written"),
        ("x[1]", "1", "takes no indices"),
        ("3", "1", "nothing can be written"),
    ],
)
def test_what_cannot_be_written_says_why(view, target, value, text):
    with pytest.raises(ExpressionError, match=text):
        view.assign(target, value)


def test_flags_exclude_each_other(view):
    view.assign("greater", "1")
    assert [view.read(flag) for flag in ("equal", "lower", "greater")] == [0, 0, 1]
    view.assign("greater", "0")
    assert [view.read(flag) for flag in ("equal", "lower", "greater")] == [0, 0, 0]


def test_names_of_the_source_have_values(view):
    view.symbols = assemble("Speed = 700\nStart: ROR 0, Speed\n       JA Start\n").symbols
    assert view.evaluate("speed * 2 + START") == 1400
    with pytest.raises(ExpressionError, match="no value named nobody"):
        view.evaluate("nobody")


def test_a_module_without_power_has_no_values(rig, view):
    rig.worlds[0].set_power(False)
    with pytest.raises(ExpressionError, match="no power"):
        view.evaluate("ap[1][0]")
    assert view.evaluate("time_ms") == 0


@pytest.mark.parametrize("model", [341, 342, 343])
def test_every_value_of_every_scope_can_be_read(model):
    rig = simple_rig(model)
    view = View.of(rig.modules[0], rig.worlds[0])
    items = [item for scope in view.scopes().values() for item in scope()]
    assert len(items) > 200
    assert len({item.expression for item in items}) == len(items)
    for item in items:
        assert isinstance(view.evaluate(item.expression), int)


def test_what_is_called_writable_takes_its_own_value(rig, view):
    for scope in view.scopes().values():
        for item in scope():
            if item.writable and item.name not in {"encoder_position", "eeprom_lock"}:
                value = view.evaluate(item.expression)
                view.assign(item.expression, str(value))
                run_until(rig, rig.now + 1)
                assert item.name == "tick_timer" or view.evaluate(item.expression) == value


def test_on_a_real_module_only_what_acts_is_read_on_demand(view):
    def silent(instruction):
        raise AssertionError(instruction)

    remote = View(silent, silent)
    acting = {item.name for items in remote.scopes().values() for item in items() if item.acting}
    assert {"load_value", "driver_error_flags", "encoder_position", "random_number"} < acting
    assert "actual_position" not in acting
    assert not any(item.acting for items in view.scopes().values() for item in items())
