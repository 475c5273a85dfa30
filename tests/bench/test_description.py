"""The bench file: what is refused, and how."""

# ruff: noqa: E501

import pytest

from tmcm34x.bench import BenchError, build, load
from tmcm34x.bench.description import parse, read
from tmcm34x.firmware.storage import Eeprom

AXIS = "[[module]]\n[[module.axis]]\n"

BAD = [
    ("", "object missing required field module"),
    ("module = []", "module: expected array of length >= 1"),
    ("x =", "invalid"),
    ("[[module]]\nmodel = 300", "module[0].model: invalid enum value 300; expected 341, 342 or 343"),
    ("[[module]]\n[[module]]\ncolour = 1", "module[1]: object contains unknown field colour; expected model, "),
    (AXIS + "[[module.axis]]\nswitch.left.position = 'x'", "module[0].axis[1].switch.left.position: expected float, got str"),
    (AXIS + "load = { kind = 'rope' }", "module[0].axis[0].load.kind: invalid value 'rope'; expected carriage"),
    (AXIS + "load = { kind = 'cariage' }", "module[0].axis[0].load.kind: invalid value 'cariage'; did you mean carriage?"),
    (AXIS + "load = { kind = 'carriage', leed_mm = 5 }", "module[0].axis[0].load: object contains unknown field leed_mm; did you mean lead_mm?"),
    (AXIS + "load = { kind = 'turntable', leed_mm = 5 }", "unknown field leed_mm; expected "),
    (AXIS + "[module.axis.switch.lefft]\nposition = 1.0", "module[0].axis[0].switch: object contains unknown field lefft; did you mean left?"),
    ("[[module]]\n[[event]]\nat_ms = 1\ndo = 'leevl'", "event[0].do: invalid enum value 'leevl'; did you mean level?"),
    (AXIS + "load = { kind = 'carriage', low = 3.0, high = 1.0 }", "module[0].axis[0].load.high: expected more than low, got 1"),
    (AXIS + "load = { kind = 'carriage', low = 3.0 }", "module[0].axis[0].load.start: beyond the hard stop low"),
    (AXIS + "load = { kind = 'carriage', force = [[0, 1], [0, 2]] }", "module[0].axis[0].load.force: expected rising positions"),
    (AXIS + "load = { kind = 'turntable', ratio = 1.00001 }", "module[0].axis[0].load.ratio: a turn of the table is 12800.1"),
    (AXIS + "load = { kind = 'turntable', torque = [[400, 1]] }", "module[0].axis[0].load.torque: expected positions from 0"),
    (AXIS + "switch.reference.position = 1.0", "module[0].axis[0].switch.reference: object missing required field width"),
    (AXIS + "load.kind = 'turntable'\nswitch.left.position = 1.0", "module[0].axis[0].switch.left: object missing required field"),
    (AXIS + "load.kind = 'turntable'\nswitch.left = { position = 1, width = 400 }", "module[0].axis[0].switch.left.width: the cam"),
    (AXIS + "switch.left.position = nan", "module[0].axis[0].switch.left.position: nan is not a number for a bench"),
    ("[[module]]\ninput.IN_0 = { kind = 'table', points = [[0, 1], [inf, 2]] }",
     "module[0].input.IN_0.points[1][0]: inf is not a number for a bench"),
    (AXIS + "switch.left.position = 1e999", "module[0].axis[0].switch.left.position: inf is not a number for a bench"),
    (AXIS + "shape = 'tube'", "module[0].axis[0].shape: invalid enum value 'tube'"),
    (AXIS + "shape = 'turntable'", "module[0].axis[0].shape: a carriage is no turntable"),
    (AXIS + "load.kind = 'turntable'\nshape = 'rail'", "module[0].axis[0].shape: a turntable is no rail"),
    ("[[module]]\nplane = [0, 0]\n[[module.axis]]", "module[0].plane: expected two motors"),
    ("[[module]]\nplane = [0, 2]\n[[module.axis]]", "module[0].plane: motor 2 drives no carriage"),
    (AXIS + "encoder.lines = 0", "module[0].axis[0].encoder.lines: expected int >= 1"),
    (AXIS + "microsteps = 10", "module[0].axis[0].microsteps: invalid enum value 10"),
    (AXIS * 1 + "[[module.axis]]\n" * 3, "module[0].axis: expected array of length <= 3"),
    ("[[module]]\ninput.IN_0 = { kind = 'constant', value = 1024 }", "module[0].input.IN_0.value: expected int <= 1023"),
    ("[[module]]\ninput.IN_0 = { kind = 'output', output = 1, module = 1 }", "module[0].input.IN_0.module: there are 1 modules"),
    ("[[module]]\ninput.IN_0 = { kind = 'table', points = [[5, 1], [5, 2]] }", "module[0].input.IN_0.points: expected rising"),
    ("[[module]]\ninput.IN_0 = { kind = 'table', points = [[5, 1]], repeat_ms = 5 }", "module[0].input.IN_0.repeat_ms: expected more"),
    ("[[module]]\ninput.SHUTDOWN = { kind = 'position', motor = 0, low = 0, high = 1 }", "module[0].input.SHUTDOWN: a potentiometer"),
    ("[[module]]\ninput.IN_1 = { kind = 'position', motor = 0, low = 1, high = 1 }", "module[0].input.IN_1.high: expected another"),
    ("[[module]]\n[[event]]\nat_ms = 1\ndo = 'fault'\nmodule = 4", "event[0].module: there are 1 modules"),
    ("[[module]]\nmodel = 342\n[[event]]\nat_ms = 1\ndo = 'fault'", "event[0].fault: a TMCM-342 has no drivers"),
    ("[[module]]\n[[event]]\nat_ms = 1\ndo = 'level'\nvalue = 5000", "event[0].value: expected a level of 0..1023, got 5000"),
]  # fmt: skip


@pytest.mark.parametrize(("text", "message"), BAD)
def test_a_mistake_is_told_in_a_line_with_its_path(text, message):
    with pytest.raises(BenchError) as caught:
        build(parse(text))
    assert message.lower() in str(caught.value).lower()
    assert "\n" not in str(caught.value)


def test_the_name_of_the_file_comes_first_and_once(tmp_path):
    path = tmp_path / "bench.toml"
    path.write_text("[[module]]\nmodel = 1")
    with pytest.raises(BenchError, match=r"bench\.toml: module\[0\]\.model: invalid enum value 1;"):
        load(path)
    path.write_text("[[module]]\n[[event]]\nat_ms = 1\ndo = 'fault'\nmodule = 4")
    with pytest.raises(BenchError, match=rf"^{path}: event\[0\]\.module: there are 1 modules$"):
        load(path)


def test_files_that_cannot_be_read_are_told(tmp_path):
    with pytest.raises(BenchError, match="No such file"):
        read(tmp_path / "none.toml")
    (tmp_path / "latin.toml").write_bytes(b"title = '\xff'")
    with pytest.raises(BenchError, match="UTF-8"):
        read(tmp_path / "latin.toml")


def test_an_address_is_written_into_a_new_memory_only():
    bench = parse("[[module]]\naddress = 5\nhost_address = 6\n[[module]]\naddress = 7")
    memory = Eeprom(343)
    rig = build(bench, [None, memory])
    assert rig.modules[0].eeprom.global_values[66] == 5
    assert rig.modules[0].eeprom.global_values[76] == 6
    assert rig.modules[1].eeprom is memory
    assert memory.global_values[66] == 1


def test_a_module_can_begin_switched_off():
    rig = build(parse("[[module]]\npowered = false"))
    assert not rig.modules[0].powered


def test_axes_are_drawn_by_what_they_drive_unless_the_file_says_otherwise():
    ends = "load = { kind = 'carriage', low = -1.0 }"
    rig = build(parse(f"[[module]]\n[[module.axis]]\n{ends}\n[[module.axis]]\nload.kind = 'turntable'\n"))
    assert [mount.fitting.shape for mount in rig.worlds[0].mounts] == ["rail", "turntable", "shaft"]
    text = f"[[module]]\nplane = [1, 0]\n[[module.axis]]\nname = 'lift'\nshape = 'belt'\n{ends}\n[[module.axis]]\n"
    world = build(parse(text)).worlds[0]
    assert world.plane == (1, 0)
    assert [(m.fitting.name, m.fitting.shape) for m in world.mounts[:2]] == [("lift", "belt"), ("", "shaft")]
