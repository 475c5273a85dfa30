"""Sweeps in Python."""

import subprocess
import sys
import textwrap

import pytest

import tmcm34x
from tmcm34x.sweep import SweepError


def test_outcomes_have_values_figures_and_errors_by_column(sweep_file):
    job = tmcm34x.sweep.load(sweep_file)
    found = sorted(tmcm34x.sweep.run(job, processes=2))
    assert [outcome.row for outcome in found] == [0, 1, 2, 3, 4, 5]
    assert found[2] == (2, {"Way": 800, "mass_kg": 1.0}, {"distance": 800, "position": 800}, "stopped", "")
    assert (found[3].figures, found[3].ending) == ({}, "")
    assert "mass_kg" in found[3].error
    assert found == [tmcm34x.sweep.run_row(job, number) for number in range(6)]


def test_only_wanted_rows_are_done(sweep_file):
    job = tmcm34x.sweep.load(str(sweep_file))
    assert [outcome.row for outcome in tmcm34x.sweep.run(job, [4], processes=1)] == [4]
    with pytest.raises(IndexError):
        list(tmcm34x.sweep.run(job, [6]))
    with pytest.raises(IndexError):
        tmcm34x.sweep.run_row(job, 6)


def test_mistakes_are_one_line_before_any_run(sweep_file):
    (sweep_file.parent / "p.tmc").write_text("Wya = 1\n STOP\n")
    with pytest.raises(
        SweepError, match=r"sweep.toml: vary\[0\].what: .* has no constant named Way; did you mean"
    ):
        tmcm34x.sweep.load(sweep_file)
    (sweep_file.parent / "p.tmc").unlink()
    with pytest.raises(SweepError, match=r"p\.tmc: No such file"):
        tmcm34x.sweep.load(sweep_file)


def test_without_the_extra_the_missing_library_is_named(sweep_file):
    """In a process where `distributed` and `pyarrow` cannot be imported."""
    code = textwrap.dedent(f"""
        import sys
        sys.modules["distributed"] = sys.modules["pyarrow.csv"] = None
        from tmcm34x.cli import main
        sys.argv[:1] = ["tmcm34x", "sweep", {str(sweep_file)!r}]
        sys.exit(main())
    """)
    for options, name in (
        (["--cluster", "tcp://127.0.0.1:1"], "distributed"),
        (["--parquet", "x"], "pyarrow.csv"),
    ):
        command = [sys.executable, "-c", code, "--processes", "1", *options]
        result = subprocess.run(command, capture_output=True, text=True, check=False, cwd=sweep_file.parent)
        assert result.returncode == 2
        last = result.stderr.splitlines()[-1]
        assert last.endswith(f"{name} is not installed; install it with: pip install 'tmcm34x[cluster]'")
