from __future__ import annotations

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
        (AXIS + "load = { kind = 'carriage', low = 5.0, high = 2.0 }\n", 4, "2.0", "more than low"),
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
