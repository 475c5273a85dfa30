"""`tmcm34x sweep` on real files."""

import csv
import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from tmcm34x.sweep.table import ResultTable

PROGRAM = "Way = 100\nDouble = Way * 2\n MVP ABS, 0, Double\n WAIT POS, 0, 0\n STOP\n"
SWEEP = """
program = "program.tmc"
until_s = 20
[[vary]]
what = "Way"
values = [100, 200]
[[vary]]
what = "ap[max_acceleration][0]"
name = "acceleration"
values = [50, 500]
[figures]
position = "ap[1][0]"
distance = "distance[0]"
time_us = "time_us"
refused = "refused"
"""
BENCH = """
[[module]]
[[module.axis]]
load = { kind = "carriage", mass_kg = 1.0 }
"""


@pytest.fixture
def sweep(invoke):
    """Call it with the text of a sweep: exit status, rows of the table, standard error."""
    Path("program.tmc").write_text(PROGRAM)
    Path("bench.toml").write_text(BENCH)

    def call(text, *options):
        Path("sweep.toml").write_text(text)
        status, _, errors = invoke("sweep", "sweep.toml", *options)
        return status, table(Path("sweep.csv")), errors

    return call


def table(path):
    return list(csv.DictReader(path.read_text().splitlines())) if path.exists() else []


def vary(what, values):
    head = 'program = "program.tmc"\nbench = "bench.toml"\nuntil_s = 5\n'
    return f'{head}[[vary]]\nwhat = "{what}"\nvalues = {values}\n[figures]\nd = "distance[0]"\n'


def test_rows_are_all_combinations_and_what_is_computed_from_a_constant_follows(sweep):
    status, rows, errors = sweep(SWEEP)
    assert (status, errors) == (0, "")
    assert [(row["row"], row["Way"], row["acceleration"]) for row in rows] == [
        ("0", "100", "50"), ("1", "100", "500"), ("2", "200", "50"), ("3", "200", "500"),
    ]  # fmt: skip
    assert [row["position"] for row in rows] == ["200", "200", "400", "400"]
    assert [row["distance"] for row in rows] == ["200", "200", "400", "400"]
    assert int(rows[1]["time_us"]) < int(rows[0]["time_us"]) < int(rows[2]["time_us"])
    assert {(row["ending"], row["error"], row["refused"]) for row in rows} == {("stopped", "", "0")}


def test_the_table_does_not_depend_on_the_number_of_processes(sweep):
    sweep(SWEEP, "--processes", "1")
    first = Path("sweep.csv").read_bytes()
    sweep(SWEEP, "--processes", "3")
    assert Path("sweep.csv").read_bytes() == first


def test_a_bench_that_cannot_be_built_fails_its_row_alone(sweep):
    status, rows, errors = sweep(vary("bench.module[0].axis[0].load.mass_kg", "[-1.0, 2.0]"))
    assert status == 1
    assert [row["ending"] for row in rows] == ["", "stopped"]
    assert errors.count("\n") == 1
    assert "row 0 (bench.module[0].axis[0].load.mass_kg -1.0): module[0].axis[0].load.mass_kg:" in errors


def test_a_value_that_the_module_refuses_fails_its_row_alone(sweep):
    status, rows, errors = sweep(vary("ap[5][0]", "[100000, 100]"))
    assert status == 1
    assert [bool(row["error"]) for row in rows] == [True, False]
    assert "row 0 (ap[5][0] 100000): ap[5][0] = 100000:" in errors


def test_a_run_that_never_ends_fails_its_row_and_keeps_its_figures(sweep):
    Path("program.tmc").write_text("Way = 100\nLoop: GGP 0, 2\n CALC ADD, 1\n AGP 0, 2\n JA Loop\n")
    status, rows, errors = sweep(vary("Way", "[1]"))
    assert status == 1
    assert (rows[0]["d"], rows[0]["ending"]) == ("0", "until")
    assert "row 0 (Way 1): not over after 5 s of simulated time" in errors


def test_a_condition_ends_runs(sweep):
    Path("program.tmc").write_text("Way = 1\nLoop: GGP 0, 2\n CALC ADD, Way\n AGP 0, 2\n JA Loop\n")
    text = vary("Way", "[1, 7]").replace("until_s", 'stop = "gp[0] >= 20"\nuntil_s')
    status, rows, _ = sweep(text.replace('d = "distance[0]"', 'v = "gp[0]"'))
    assert status == 0
    assert [(row["v"], row["ending"]) for row in rows] == [("20", "break"), ("21", "break")]


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (('"Way"', '"Wya"'), "vary[0].what: program.tmc has no constant named Wya; did you mean"),
        (("[100, 200]", "[]"), "vary[0].values:"),
        (('"ap[max_acceleration][0]"', '"bench.seed"'), "vary[1].what: bench.seed: the sweep has no bench"),
        (('"distance[0]"', '"distance[7]"'), "figures.distance: distance: motors are 0 to 2"),
        (('"ap[1][0]"', '"speed"'), "figures.position: no value named speed"),
        (('"program.tmc"', '"missing.tmc"'), "missing.tmc: No such file"),
        (("until_s = 20", "until_s = 0"), "until_s:"),
        (("until_s = 20", "until = 20"), "unknown field"),
        (('name = "acceleration"', 'name = "Way"'), "vary[1]: there are two columns named Way"),
    ],
)
def test_mistakes_in_the_sweep_are_one_line_before_the_first_run(sweep, change, message):
    status, rows, errors = sweep(SWEEP.replace(*change))
    assert (status, rows) == (2, [])
    assert message in errors
    assert errors.count("\n") == 0


def test_an_unknown_place_of_the_bench_names_what_is_there(sweep):
    status, _, errors = sweep(vary("bench.module[0].axis[0].load.mas_kg", "[1.0]"))
    assert status == 2
    assert "the bench has no mas_kg there; there are" in errors
    assert "mass_kg" in errors


def test_the_example(tmp_path):
    example = Path(__file__).parents[2] / "examples" / "sweeps" / "xy-stage.toml"
    out = tmp_path / "out.csv"
    picture = tmp_path / "out.svg"
    command = [
        Path(sys.executable).with_name("tmcm34x"),
        "sweep",
        example,
        "--out",
        out,
        "--picture",
        picture,
    ]
    result = subprocess.run(command, capture_output=True, text=True, check=False)
    assert (result.returncode, result.stderr) == (0, "")
    assert picture.read_bytes() == (Path(__file__).parents[2] / "docs/images/xy-stage.svg").read_bytes()
    rows = table(out)
    best = {}
    for row in rows:
        if (row["lost_x"], row["lost_y"]) == ("0", "0"):
            best[row["mass_kg"]] = min(
                row, best.get(row["mass_kg"], row), key=lambda each: int(each["time_us"])
            )
    found = {mass: (row["Acceleration"], row["Speed"]) for mass, row in best.items()}
    assert found == {"1.0": ("800", "1600"), "2.0": ("800", "1200"), "4.0": ("400", "1200")}


def test_resume_keeps_what_is_done_and_leaves_out_a_line_that_was_cut(sweep):
    sweep(SWEEP)
    whole = Path("sweep.csv").read_text()
    lines = whole.splitlines(keepends=True)
    Path("sweep.csv").write_text(
        "".join([lines[0], lines[3], lines[1].replace(",200,", ",777,")]) + lines[2][:9]
    )
    status, rows, _ = sweep(SWEEP, "--resume")
    assert status == 0
    assert [row["row"] for row in rows] == ["0", "1", "2", "3"]
    assert rows[0]["distance"] == "777" or rows[0]["position"] == "777"
    assert Path("sweep.csv").read_text().splitlines()[2:] == whole.splitlines()[2:]


def test_resume_refuses_the_table_of_another_sweep(sweep):
    sweep(SWEEP)
    status, _, errors = sweep(SWEEP.replace("[100, 200]", "[150, 200]"), "--resume")
    assert status == 2
    assert "sweep.csv: row 0 has other values than in this sweep" in errors
    status, _, errors = sweep(SWEEP.replace("distance =", "way ="), "--resume")
    assert status == 2
    assert "sweep.csv: its columns are not those of this sweep" in errors


def test_failed_rows_are_done_again(sweep):
    text = vary("bench.module[0].axis[0].load.mass_kg", "[-1.0, 2.0]")
    sweep(text)
    status, rows, _ = sweep(text, "--resume")
    assert (status, len(rows)) == (1, 2)


def test_a_row_alone_is_the_row_of_the_table_with_a_picture_or_without(tmp_path):
    example = Path(__file__).parents[2] / "examples" / "sweeps" / "xy-stage.toml"
    command = [Path(sys.executable).with_name("tmcm34x"), "sweep", example, "--row", "71"]
    bare = subprocess.run(command, capture_output=True, text=True, check=False)
    plot = tmp_path / "row.svg"
    drawn = subprocess.run([*command, "--plot", plot], capture_output=True, text=True, check=False)
    assert (drawn.returncode, drawn.stderr) == (0, "")
    assert drawn.stdout == bare.stdout
    assert "lost_x: 1000" in bare.stdout
    assert plot.read_text().startswith("<svg")


def test_a_row_that_is_not_there_is_a_usage_error(sweep):
    status, _, errors = sweep(SWEEP, "--row", "4")
    assert status == 2
    assert "--row 4: the rows are 0 to 3" in errors


def test_the_picture_has_a_panel_for_each_figure_and_value(sweep):
    status, _, errors = sweep(SWEEP, "--picture", "sweep.svg")
    assert (status, errors) == (0, "")
    text = Path("sweep.svg").read_text()
    for figure in ("position", "distance", "time_us", "refused"):
        assert f"{figure} against Way" in text
        assert f"{figure} against acceleration" in text


def test_without_figures_there_is_no_picture(sweep):
    text = vary("bench.module[0].axis[0].load.mass_kg", "[-1.0]")
    status, _, errors = sweep(text, "--picture", "sweep.svg")
    assert status == 2
    assert "sweep.svg: no row has figures" in errors


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM], ids=["SIGINT", "SIGTERM"])
def test_an_interrupt_keeps_what_is_done_and_resume_completes_it(sweep, monkeypatch, number):
    """The signal comes with the second row."""
    write = ResultTable.write
    written = []

    def interrupting(table, row, result):
        write(table, row, result)
        written.append(row)
        if len(written) == 2:
            os.kill(os.getpid(), number)

    monkeypatch.setattr(ResultTable, "write", interrupting)
    status, rows, errors = sweep(SWEEP, "--processes", "1")
    assert (status, errors) == (130, "")
    assert [int(row["row"]) for row in rows] == sorted(written)
    assert len(written) == 2
    status, rows, _ = sweep(SWEEP, "--resume")
    assert (status, len(rows), len(written)) == (0, 4, 4)
