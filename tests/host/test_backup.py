"""Backups, restores and comparisons, over lines with and without faults."""

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from host_rigs import PROGRAM, connected, faulty, module_of
from tmcm34x.bench import simple_rig
from tmcm34x.bench.in_process import BITS_PER_BYTE
from tmcm34x.host import Connection, FileError, LinkError, Module, NoReplyError, backup, restore
from tmcm34x.host.program import download
from tmcm34x.host.reading import Absent, Value
from tmcm34x.tmcl.datagram import SIZE, Instruction


@pytest.fixture
def original():
    """A module that somebody has used for years."""
    connection = connected()
    module = Module(connection)
    x = module.axes[0]
    x.max_speed = 777
    x.store("max_speed")
    x.max_speed = 888
    x.pulse_divisor, x.ramp_divisor, x.max_acceleration = 5, 9, 321
    for key in ("pulse_divisor", "ramp_divisor", "max_acceleration"):
        x.store(key)
    module.axes[1].group_index = 3
    module.variables[3] = 55
    module.variables.store(3)
    module.variables[3] = -66
    module.coordinates[4, 1] = 1234
    connection.command(30, 4, 255)  # SCO 4, 255: store
    module.coordinates[4, 1] = -4321
    module.coordinates[0, 2] = 17
    module.microstep_table_3 = 0x01020304
    connection.command(11, 23)  # STGP 23: store the table
    module.microstep_table_3 = 0x04030201
    module.can_id, module.can_reply_id, module.host_address = 33, 44, 3
    module.auto_start = 1
    connection.run(download(PROGRAM))
    module.serial_address = connection.address = 7
    module.baud_rate = 7
    connection.line.baud = 115200
    return connection


def test_a_backup_has_both_values_and_leaves_the_module_as_it_was(original):
    before = module_of(original).eeprom.to_bytes(), [dict(axis.values) for axis in module_of(original).axes]
    saved = original.run(backup.read())
    assert saved.complete
    found = {item.path: reading for item, reading in saved.present.items()}
    stored = {item.path: reading for item, reading in saved.stored.items()}
    assert (found["axis.0.max_speed"], stored["axis.0.max_speed"]) == (Value(888), Value(777))
    assert (found["variables.3"], stored["variables.3"]) == (Value(-66), Value(55))
    assert found["coordinates.4 of motor 1"] == Value(-4321)
    assert stored["coordinates.4 of motor 1"] == Value(1234)
    assert stored["chip.microstep_table_3"] == Value(0x01020304)
    assert saved.program == PROGRAM
    assert before == (
        module_of(original).eeprom.to_bytes(), [dict(axis.values) for axis in module_of(original).axes]
    )  # fmt: skip
    assert Module(original).microstep_table_3 == 0x04030201


def test_nothing_but_telegrams_takes_time_in_a_backup(original):
    begin, sent = original.line.now(), original.counts.sent
    original.run(backup.read())
    wire_s = (original.counts.sent - sent) * 2 * SIZE * BITS_PER_BYTE / original.line.baud
    assert original.line.now() - begin == pytest.approx(wire_s, rel=0.002)


def test_the_file_says_the_same_and_is_stable(original):
    saved = original.run(backup.read())
    text = backup.to_text(saved)
    assert text.startswith("# Complete backup of a TMCM-343, firmware 343V4.36\n")
    again = backup.from_text(text, "module.toml")
    assert backup.compare(saved, again) == []
    assert backup.to_text(again) == text
    assert backup.to_text(original.run(backup.read())) == text


def test_clone_over_a_line_where_one_reply_in_twenty_is_damaged(original):
    """The spare begins at another address with factory settings; after a power cycle both are equal."""
    source = connected(
        original.line.rig, address=7, baud=115200, faults=faulty("garble,probability=0.05", seed=1)
    )
    wanted = source.run(backup.read())
    assert wanted.complete
    spare = connected(simple_rig(343, address=9), address=9, faults=faulty("garble,probability=0.05", seed=2))
    present = spare.run(backup.read())
    assert len(restore.plan(wanted, present).differences) > 40
    assert spare.run(restore.restore(wanted, present)) == []
    assert (spare.address, spare.line.baud) == (7, 115200)
    assert restore.unequal(wanted, spare.run(backup.read())) == []
    assert source.counts.retried > 50
    assert spare.counts.retried > 50
    for connection in (original, spare):
        module_of(connection).power_off()
        module_of(connection).power_on()
        connection.command(128)  # the program starts by itself (77)
        assert connection.command(12, 3, 2) == 0  # RSGP: the program has written its variables
    first, second = (connection.run(backup.read()) for connection in (original, spare))
    assert first.complete
    assert backup.compare(first, second) == []
    assert module_of(original).eeprom.to_bytes() == module_of(spare).eeprom.to_bytes()


@pytest.mark.parametrize("fault", ["drop,probability=0.08", "late_reply,probability=0.05", "stray=3,probability=0.1",
                                   "duplicate,probability=0.1", "split,probability=0.2", "silent,probability=0.05",
                                   "drop=2,probability=0.08",
                                   "status=1,probability=0.08"])  # fmt: skip
def test_every_kind_of_fault_is_lived_with(original, fault):
    wanted = original.run(backup.read())
    spare = connected(simple_rig(343, address=9), address=9, faults=faulty(fault))
    present = spare.run(backup.read())
    assert present.complete
    assert spare.run(restore.restore(wanted, present)) == []
    assert restore.unequal(wanted, spare.run(backup.read())) == []
    assert module_of(original).eeprom.to_bytes() == module_of(spare).eeprom.to_bytes()


@pytest.mark.parametrize("seed", range(4))
def test_one_damaged_reply_in_thirteen_leaves_a_backup_complete(original, seed):
    rig = original.line.rig
    damaged = connected(rig, address=7, baud=115200, faults=faulty("garble,probability=0.077", seed=seed))
    assert backup.compare(damaged.run(backup.read()), original.run(backup.read())) == []


def test_a_restore_that_changes_nothing_writes_nothing(original):
    wanted = original.run(backup.read())
    revision = module_of(original).eeprom.revision
    assert restore.plan(wanted, wanted).differences == []
    assert original.run(restore.restore(wanted, wanted)) == []
    assert module_of(original).eeprom.revision == revision


def test_what_is_kept_keeps_its_value(original):
    wanted = original.run(backup.read())
    spare = connected(simple_rig(343, address=9), address=9)
    keep = ("serial_address", "baud_rate")
    assert spare.run(restore.restore(wanted, spare.run(backup.read()), keep)) == []
    after = spare.run(backup.read())
    assert restore.unequal(wanted, after, keep) == []
    assert {row.path for row in backup.compare(wanted, after)} == {
        "module.serial_address",
        "module.baud_rate",
    }


def test_a_locked_eeprom_is_unlocked_and_said(original):
    wanted = original.run(backup.read())
    spare = connected()
    Module(spare).eeprom_lock = 1234
    present = spare.run(backup.read())
    assert any("locked" in line for line in restore.plan(wanted, present).warnings)
    assert spare.run(restore.restore(wanted, present)) == []
    assert restore.unequal(wanted, spare.run(backup.read())) == []


def test_a_protected_program_is_not_read_but_everything_else_is(original):
    Module(original).code_protection = 1
    saved = original.run(backup.read())
    assert not saved.complete
    assert saved.program is None
    assert [
        line for line in saved.not_read if not line.startswith("program: the program memory is protected")
    ] == []
    text = backup.to_text(saved)
    assert text.startswith("# INCOMPLETE backup (1 not read, see not_read)")
    assert backup.from_text(text, "x").not_read == saved.not_read


def test_a_protection_in_the_way_is_given_up_and_named(original):
    wanted = original.run(backup.read())
    spare = connected()
    spare.run(download([Instruction(28)]))
    Module(spare).code_protection = 3
    present = spare.run(backup.read())
    assert any("wipes" in line for line in restore.plan(wanted, present).warnings)
    assert spare.run(restore.restore(wanted, present)) == []
    assert restore.unequal(wanted, spare.run(backup.read())) == []


def test_stored_values_are_not_touched_while_a_program_runs_or_a_motor_turns(original):
    original.command(1, 0, 2, 100)
    turning = original.run(backup.read())
    assert turning.not_read == ["stored values are not read: motor 2 is turning"]
    assert isinstance(next(iter(turning.stored.values())), Absent)
    original.command(3, 0, 2)


def test_values_in_use_come_back_when_a_backup_is_interrupted(original):
    def interrupted(done, total):
        if done == 400:
            raise KeyboardInterrupt

    before = (
        [dict(axis.values) for axis in module_of(original).axes],
        list(module_of(original).program.variables),
    )
    for _ in range(3):
        with pytest.raises(KeyboardInterrupt):
            original.run(backup.read(progress=interrupted))
    assert before == (
        [dict(axis.values) for axis in module_of(original).axes], list(module_of(original).program.variables)
    )  # fmt: skip


def test_a_module_that_loses_power_ends_a_backup_soon(original):
    def cut(done, total):
        if done == 50:
            module_of(original).power_off()

    start = original.line.now()
    with pytest.raises(NoReplyError, match="stopped replying"):
        original.run(backup.read(progress=cut))
    assert original.line.now() - start < 60


def test_a_line_that_is_cut_ends_a_backup(served_tcp):
    connection, stop = served_tcp

    def cut(done, total):
        if done == 50:
            stop()

    with pytest.raises(LinkError, match=r"hung up|reset|Broken"):
        connection.run(backup.read(progress=cut))


def test_a_line_that_is_cut_in_a_restore_or_a_download_is_said(original, serve):
    wanted = original.run(backup.read())
    for operation in ("restore", "download"):
        served = serve("--tcp", 0)
        with Connection.open(served.tcp) as connection:
            present = connection.run(backup.read(stored=False))
            count = 0

            def cut(*_):
                nonlocal count
                count += 1
                if count == 20:
                    served.stop()  # noqa: B023

            with pytest.raises(LinkError):
                if operation == "restore":
                    connection.run(restore.restore(wanted, present, progress=cut))
                else:
                    connection.run(download(PROGRAM, progress=cut))


def test_a_module_that_restarts_in_a_restore_is_not_called_equal(original):
    """What was only in use is gone: reading back finds it."""
    wanted = original.run(backup.read())
    spare = connected()
    count = 0

    def restart(*_):
        nonlocal count
        count += 1
        if count == 120:
            module_of(spare).power_off()
            module_of(spare).power_on()

    present = spare.run(backup.read())
    spare.run(restore.restore(wanted, present, ("serial_address", "baud_rate"), restart))
    paths = {
        row.path for row in restore.unequal(wanted, spare.run(backup.read()), ("serial_address", "baud_rate"))
    }
    assert "axis.0.max_speed" in paths
    assert "axis.0.max_speed, stored" not in paths


@pytest.fixture
def served_tcp(serve):
    """A connection to a served module, and how to end it."""
    served = serve("--tcp", 0)
    with Connection.open(served.tcp) as connection:
        yield connection, served.stop


def test_models_differ_in_their_rows():
    small, large = (connected(simple_rig(model)).run(backup.read()) for model in (342, 343))
    paths = {row.path for row in backup.compare(small, large)}
    assert "model" in paths
    assert "axis.0.max_current" in paths


def test_a_stored_command_that_looks_like_a_report_of_damage_is_read():
    """On the module with address 6 the reply with GAP 1, 0 is byte for byte that of a wrong checksum."""
    connection = connected(simple_rig(343, address=6), address=6)
    program = (Instruction(6, 1), Instruction(28), Instruction(6, 1, 1))
    connection.run(download(program))
    assert connection.run(backup.read()).program == program


@pytest.mark.parametrize(
    ("line", "text", "message"),
    [
        (
            "max_speed = 888",
            "max_spede = 888",
            r"module.toml:\d+: axis.0.max_spede: .* did you mean max_speed\?",
        ),
        (
            "max_speed = 888",
            "max_speed = 8888",
            r"module.toml:\d+: axis.0.max_speed: must be 0..2047, not 8888",
        ),
        ("max_speed = 888", 'max_speed = "fast"', r"axis.0.max_speed: must be a whole number, not 'fast'"),
        ("max_speed = 888", "max_speed = true", "must be a whole number"),
        ("max_speed = 888", "max_speed = ", r"module.toml:\d+: not TOML"),
        ("format = 1", "format = 2", r"module.toml:\d+: not a backup: it needs format = 1"),
        ("model = 343", "model = 351", "model: must be one of 341, 342, 343"),
        ("[axis.0]", "[axis.5]", r"axis.5: motors are 0..2"),
        ("[chip]", "[chips]", "chips: there is no such name; did you mean chip"),
        ("length = 41", "lenght = 41", "program.lenght"),
        ("09 00 02 00 00 00 00 0b", "09 00 02 00 00 00 00 0c", r"module.toml:\d+: program.image: checksum"),
        (" 1, 2, 7919 ", " 1, 2, 7920 ", "program.source: says another program"),
        ("4 = [0, -4321, 0]", "4 = [0, -4321]", "coordinates.4: must be a list of 3 positions"),
    ],
)
def test_an_edited_file_is_refused_with_path_and_line(original, line, text, message):
    whole = backup.to_text(original.run(backup.read()))
    assert line in whole
    with pytest.raises(FileError, match=message):
        backup.from_text(whole.replace(line, text), "module.toml")


@settings(max_examples=50)
@given(st.lists(st.integers(0, 30), max_size=12), st.lists(st.integers(0, 30), max_size=12))
def test_runs_cover_all_that_differs(wanted, found):
    ours, theirs = ([Instruction(n) for n in memory] + [Instruction(0)] * 50 for memory in (wanted, found))
    theirs = (theirs + [Instruction(0)] * 50)[: len(ours)]
    covered = {address for start, end in restore.runs(ours, theirs) for address in range(start, end)}
    assert covered >= {n for n in range(len(ours)) if ours[n] != theirs[n]}
