"""Files as they should not be: cut at any length, flipped bits, folders, links in a circle, pipes, devices without end.

Each is taken or refused; a refusal of the system is one line, and no command ever shows a traceback.
"""

import os
import random
import threading

import pytest

from tmcm34x.cli import run
from tmcm34x.firmware.storage import Eeprom

PROGRAM = "Loop: MVP ABS, 0, 100\n  WAIT POS, 0, 0\n  CALC ADD, 3\n  COMP 5\n  JC LT, Loop\n  STOP\n"
BENCH = """\
title = "one axis"
[[module]]
model = 343
[[module.axis]]
load = { kind = "carriage", lead_mm = 5.0, mass_kg = 1.5, friction_n = 4.0, low = -2.0, high = 202.0, start = 60.0 }
switch.left = { position = 0.0, hysteresis = 0.05 }
"""
SESSION = "== reads\n> GAP 4, 0\n< 100 1000\n"
SHORT = ("--until", "0.001")
USES = {
    "program.tmc": (
        ("run", "FILE", *SHORT),
        ("lint", "FILE"),
        ("asm", "FILE", "-o", os.devnull),
        ("fmt", "--check", "FILE"),
    ),
    "program.bin": (("run", "FILE", *SHORT), ("dis", "FILE")),
    "program.hex": (("dis", "FILE"),),
    "bench.toml": (("run", "good/program.tmc", *SHORT, "--bench", "FILE"),),
    "reads.session": (
        ("show", "FILE"),
        ("play", "--model", "343", "--link", "serial", "FILE"),
        ("check", "FILE"),
    ),
    "recording.pcapng": (("show", "FILE"), ("check", "FILE")),
    "bench.state": (("run", "good/program.tmc", *SHORT, "--from-state", "FILE"),),
    "module.toml": (
        ("compare", "FILE", "FILE"),
        ("restore", "--yes", "--port", "virtual:343", "FILE"),
    ),
    "settings.toml": (("settings", "load", "--yes", "--port", "virtual:343", "FILE"),),
    "memory.eeprom": (("check", "good/reads.session", "--eeprom", "FILE"),),
}
RUBBISH = (
    b"",
    b"\0" * 4096,
    b"\xff\xfe\0",
    "\u2028\x85\x0c\ud7ff".encode() * 50,
    b"[" * 50_000,
    b"(" * 50_000,
    b"a = " + b"9" * 10_000,
    b"a = " + b"[" * 50_000,
    b"a" + b".a" * 30_000 + b" = 1",
    b"a = nan\nb = 1e999",
    b"#if 1\n" * 5000,
    b"> " * 9999,
)


@pytest.fixture
def good(tmp_path, monkeypatch, capsys):
    """A folder with one sound file of each kind, below the present one."""
    monkeypatch.chdir(tmp_path)
    folder = tmp_path / "good"
    folder.mkdir()
    (folder / "program.tmc").write_text(PROGRAM)
    (folder / "bench.toml").write_text(BENCH)
    (folder / "reads.session").write_text(SESSION)
    (folder / "memory.eeprom").write_bytes(Eeprom(343).to_bytes())
    for words in (
        ("asm", "good/program.tmc", "-o", "good/program.bin"),
        ("asm", "good/program.tmc", "-o", "good/program.hex"),
        ("run", "good/program.tmc", *SHORT, "--save-state", "good/bench.state"),
        ("backup", "--port", "virtual:343", "good/module.toml"),
        ("settings", "dump", "--port", "virtual:343", "good/settings.toml"),
        ("show", "good/reads.session", "--to", "good/recording.pcapng"),
    ):
        assert run(list(words)) == 0
    capsys.readouterr()
    return folder


@pytest.fixture
def judge(capsys):
    """Call it with a file's kind and its path: each command that takes it ends as documented."""

    def call(kind, path):
        for words in USES[kind]:
            status = run([str(path) if word == "FILE" else word for word in words])
            errors = capsys.readouterr().err
            assert 0 <= status <= 4, (words, errors)
            assert "Traceback" not in errors
            assert status != 2 or errors.count("\n") == 1, (words, errors)

    return call


@pytest.mark.parametrize("kind", USES)
def test_sound_files_are_taken(good, judge, kind, capsys):
    for words in USES[kind]:
        assert run([f"good/{kind}" if word == "FILE" else word for word in words]) in {0, 1}, (
            capsys.readouterr().err
        )


@pytest.mark.parametrize("kind", USES)
def test_cut_and_flipped_files_are_taken_or_refused(good, judge, kind, tmp_path):
    data, draw = (good / kind).read_bytes(), random.Random(kind)
    bad = tmp_path / f"bad-{kind}"
    for length in {
        *range(0, min(len(data), 6)),
        *(draw.randrange(len(data)) for _ in range(3)),
        len(data) - 1,
    }:
        bad.write_bytes(data[:length])
        judge(kind, bad)
    for flips in (1, 1, 1, 2, 8, 100):
        flipped = bytearray(data)
        for _ in range(flips):
            flipped[draw.randrange(len(data))] ^= 1 << draw.randrange(8)
        bad.write_bytes(flipped)
        judge(kind, bad)


@pytest.mark.parametrize("kind", USES)
def test_rubbish_is_refused_in_time(good, judge, kind, tmp_path):
    bad = tmp_path / f"bad-{kind}"
    for data in RUBBISH:
        bad.write_bytes(data)
        judge(kind, bad)


@pytest.mark.parametrize("kind", USES)
def test_what_is_no_file_is_refused(good, judge, kind, tmp_path):
    circle, folder, far = (tmp_path / f"{name}-{kind}" for name in ("circle", "folder", "far"))
    circle.symlink_to(circle.name)
    folder.mkdir()
    far.symlink_to("/proc/self/mem")
    for path in (circle, folder, far, tmp_path / "nowhere" / kind, tmp_path / f"{'x' * 300}-{kind}"):
        judge(kind, path)


@pytest.mark.parametrize("kind", ["program.tmc", "bench.toml", "reads.session", "module.toml"])
def test_a_pipe_that_ends_is_read_like_a_file(good, kind, tmp_path, capsys):
    pipe = tmp_path / f"pipe-{kind}"
    os.mkfifo(pipe)
    uses = next(words for words in USES[kind] if words.count("FILE") == 1)
    words = [str(pipe) if word == "FILE" else word for word in uses]
    data = (good / kind).read_bytes()
    writer = threading.Thread(target=pipe.write_bytes, args=(data,), daemon=True)
    writer.start()
    status = run(words)
    assert status in {0, 1}, capsys.readouterr().err
    writer.join(10)


@pytest.mark.parametrize("kind", ["program.tmc", "bench.toml", "reads.session", "module.toml", "bench.state"])
def test_a_device_without_end_is_refused(good, judge, kind, tmp_path, monkeypatch):
    monkeypatch.setattr("tmcm34x.files.ENDLESS_LIMIT", 1 << 20)
    endless = tmp_path / f"endless-{kind}"
    endless.symlink_to("/dev/zero")
    judge(kind, endless)


@pytest.mark.skipif(os.geteuid() == 0, reason="the superuser may read everything")
@pytest.mark.parametrize("kind", USES)
def test_a_file_without_permission_is_refused(good, judge, kind):
    path = good / kind
    path.chmod(0)
    judge(kind, path)
