from __future__ import annotations

import re
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

from tmcm34x.bench.check import check, is_bench
from tmcm34x.bench.completion import complete
from tmcm34x.bench.places import Places

BENCHES = sorted((Path(__file__).parents[2] / "examples" / "benches").glob("*.toml"))


def _leaves(value, path=()):
    if isinstance(value, dict):
        for name, inner in value.items():
            yield from _leaves(inner, (*path, name))
    elif isinstance(value, list):
        for index, inner in enumerate(value):
            yield from _leaves(inner, (*path, index))
    else:
        yield path, value


@pytest.mark.parametrize("file", BENCHES, ids=lambda file: file.stem)
def test_every_value_of_a_bench_is_found_where_it_stands(file):
    text = file.read_text()
    places, lines = Places(text), text.splitlines()
    for path, value in _leaves(tomllib.loads(text)):
        line, column, end = places.find(path)
        assert tomllib.loads(f"x = {lines[line - 1][column - 1 : end - 1]}")["x"] == value, path
    assert check(text, file.name) == []


AXIS = "[[module]]\nmodel = 343\n[[module.axis]]\n"


@pytest.mark.parametrize(
    ("text", "line", "marked", "said"),
    [
        ("[[module]]\nmodel = 999\n", 2, "999", "module[0].model"),
        ("[[module]\nmodel = 343\n", 1, "", "']]'"),
        ("[[module]]\nmodel = 'a\n", 2, "", "expected"),
        ("title = 'x'\n", 1, "t", "required field module"),
        (AXIS + "load = { lead = 5.0 }\n", 4, "load", "kind"),
        (AXIS + "load = { kind = 'carriage', lead = 5.0 }\n", 4, "lead", "unknown field lead"),
        (AXIS + "load = { kind = 'carriage', low = -2.0, high = -5.0 }\n", 4, "-5.0", "more than low"),
        (AXIS + "load.kind = 'carriage'\nload.low = nan\n", 5, "nan", "not a number"),
        (AXIS + "\n[[module.axis]]\nmotor.steps_per_turn = 0\n", 6, "0", "module[0].axis[1].motor"),
        ("[[module]]\n[module.input.IN_0]\nkind = 'table'\npoints = [\n [0, 1],\n [2, 'x']]\n", 6, "'x'", "points[1]"),
        ('[[module]]\ntitle = """\nkind = 3"""\n', 2, "title", "unknown field title"),
    ],
)  # fmt: skip
def test_a_mistake_is_marked_where_it_is(text, line, marked, said):
    (found,) = check(text, "b.toml")
    place = found.location
    assert (place.line, said in found.text) == (line, True), found
    if marked:
        assert text.splitlines()[line - 1][place.column - 1 : place.end - 1] == marked


MANY = """\
titel = "x"
instruction_us = -1

[[module]]
model = 343
colour = "red"
[[module.axis]]
load = { kind = "carriage", low = 5.0, high = 2.0, start = "left" }
[[module.axis]]
shape = "turntable"
load = { kind = "carriage", lead = 5.0, low = -1.0, high = -2.0 }
switch.left = { hysteresis = 1.0 }

[[module]]
address = 300
[[module.axis]]
motor.steps_per_turn = 0

[[event]]
at_ms = 1.0
do = "jump"
[[event]]
at_ms = 2.0
do = "unplug"
module = 7
"""


def test_all_mistakes_are_found_each_in_its_place():
    found = check(MANY, "b.toml")
    lines = MANY.splitlines()
    marked = [
        (at.line, lines[at.line - 1][at.column - 1 : at.end - 1]) for at in (each.location for each in found)
    ]
    assert marked == [
        (1, "titel"), (2, "-1"), (6, "colour"), (8, '"left"'), (10, '"turntable"'), (11, "lead"), (11, "-2.0"),
        (12, "left"), (15, "300"), (17, "0"), (21, '"jump"'), (25, "7"),
    ]  # fmt: skip
    assert "module[1].address" in next(each.text for each in found if each.location.line == 15)


def test_what_follows_from_a_mistake_is_not_said():
    text = AXIS + "load = { kind = 'carriage', low = 'x', high = -5.0, start = -7.0 }\n"
    assert [each.text.partition(":")[0] for each in check(text, "b.toml")] == ["module[0].axis[0].load.low"]


def test_every_mistake_in_a_bench_is_found_beside_the_others():
    """Each value of an example is spoilt: all are named, or were in a table that was left out."""
    text = BENCHES[0].read_text()
    spoilt = re.sub(r"= (?:[0-9][0-9.]*|true|false)$", "= []", text, flags=re.MULTILINE)
    places = {each.location.line for each in check(spoilt, "b.toml")}
    wanted = {n for n, line in enumerate(spoilt.splitlines(), 1) if line.endswith("= []")}
    assert places == wanted


@pytest.mark.parametrize(
    ("path", "text", "bench"),
    [
        ("a.toml", "[[module]]\n", True),
        ("a.toml", "[[modul]]\n", True),
        ("benches/a.toml", "", True),
        ("settings.toml", "model = 343\n[axis.0]\nmax_speed = 5\n", False),
        ("bench.tmc", "[[module]]\n", False),
    ],
)
def test_other_toml_files_are_no_benches(path, text, bench):
    assert is_bench(path, text) is bench


@pytest.mark.parametrize(
    ("text", "some"),
    [
        ("", {"module", "title", "event"}),
        ("[[mo", {"module", "event"}),
        ("[[module.", {"axis", "input"}),
        ("[[module]]\nmo", {"model", "axis"}),
        ("[[module]]\nmodel = ", {"341", "342", "343"}),
        ("[[module]]\npowered = ", {"true", "false"}),
        ("[[module.axis]]\nload = { ", {'kind = "carriage"', 'kind = "turntable"', "lead_mm", "ratio"}),
        ('[[module.axis]]\nload = { kind = "turntable", r', {"ratio", "friction_nm"}),
        ("[[module.axis]]\nswitch.le", {"left", "right"}),
        ("[[module.axis]]\nswitch.left = { po", {"position", "hysteresis"}),
        ("[module.input]\nIN_0 = { kind = '", {'"sine"', '"square"'}),
        ("[[event]]\ndo = ", {'"fault"', '"power"'}),
        ("[nowhere]\nx", set()),
    ],
)
def test_what_fits_at_a_place_is_proposed(text, some):
    lines = text.split("\n")
    found = {each.label for each in complete(text, len(lines), len(lines[-1]) + 1)}
    assert found >= some
    assert bool(found) == bool(some)
    if 'kind = "turntable"' in text:
        assert "lead_mm" not in found


@pytest.mark.parametrize("part", ["x", "x.", "x = {", "[", " "])
def test_a_line_of_any_length_costs_little(part):
    line = part * 90_000
    assert complete(line, 1, len(line) + 1) == []


_IN_THREADS = """
import threading
from tmcm34x.bench.description import parse

together = threading.Barrier(4)

def read():
    together.wait()
    parse("[[module]]")

threads = [threading.Thread(target=read) for _ in range(4)]
for thread in threads:
    thread.start()
for thread in threads:
    thread.join()
"""


def test_the_first_benches_of_a_process_may_be_read_in_several_threads():
    """msgspec crashes the interpreter when two threads have it learn a struct; the IDE checks benches in threads."""
    for _ in range(3):
        assert subprocess.run([sys.executable, "-c", _IN_THREADS], check=False).returncode == 0
