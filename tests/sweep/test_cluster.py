"""A sweep on a cluster of two workers on this machine."""

import subprocess
import sys
from pathlib import Path

import pyarrow.parquet
import pytest
from distributed import LocalCluster

from tmcm34x.sweep import SweepError, cluster, load, run

COMMAND = str(Path(sys.executable).with_name("tmcm34x"))
DASK = str(Path(sys.executable).with_name("dask"))
HOST = "127.0.0.1"


def _start(*arguments, announced):
    """A process, and the word behind `announced` in what it prints."""
    process = subprocess.Popen(
        [DASK, *arguments], stderr=subprocess.PIPE, stdout=subprocess.DEVNULL, text=True
    )
    for line in process.stderr:
        if announced in line:
            return process, line.split(announced)[1].split()[0]
    raise AssertionError(f"{arguments}: ended")


@pytest.fixture(scope="module")
def two_workers():
    """The address of a scheduler with two workers of one thread."""
    options = ["--host", HOST, "--port", "0", "--dashboard-address", f"{HOST}:0"]
    scheduler, address = _start("scheduler", *options, announced="Scheduler at:")
    address = address.strip()
    workers = [
        _start("worker", address, "--nthreads", "1", "--no-dashboard", announced="Registered to:")[0]
        for _ in range(2)
    ]
    yield address
    for process in (*workers, scheduler):
        process.terminate()
    for process in (*workers, scheduler):
        process.communicate()


def sweep(file, *options):
    command = [COMMAND, "sweep", file, "--out", file.with_suffix(".csv"), *options]
    result = subprocess.run(command, capture_output=True, text=True, check=False)
    return result, file.with_suffix(".csv").read_bytes()


def test_a_cluster_and_this_machine_give_identical_tables(two_workers, sweep_file):
    parquet = sweep_file.with_suffix(".parquet")
    local, table = sweep(sweep_file, "--processes", "2")
    remote, same = sweep(sweep_file, "--cluster", two_workers, "--parquet", parquet)
    assert same == table
    assert (remote.returncode, remote.stdout) == (1, local.stdout)
    ours = [
        line for line in remote.stderr.splitlines() if "distributed." not in line
    ]  # it tells of busy machines
    assert sorted(ours) == sorted(local.stderr.splitlines())
    columns = pyarrow.parquet.read_table(parquet).to_pydict()
    assert columns["Way"] == [400, 400, 800, 800, 1600, 1600]
    assert columns["mass_kg"] == [1.0, -1.0] * 3
    assert columns["distance"] == [400, None, 800, None, 1600, None]
    assert columns["ending"] == ["stopped", ""] * 3
    assert [bool(error) for error in columns["error"]] == [False, True] * 3


def test_an_address_without_a_scheduler_is_one_line(sweep_file):
    result, _ = sweep(sweep_file, "--cluster", "tcp://127.0.0.1:1")
    assert result.returncode == 2
    assert result.stderr.count("\n") == 1
    assert "tcp://127.0.0.1:1: no scheduler answers there; start one with: dask scheduler" in result.stderr
    result, _ = sweep(sweep_file, "--cluster", "nonsense")
    assert (result.returncode, result.stderr.count("\n")) == (2, 1)
    assert "nonsense: the address of a scheduler is written as tcp://HOST:PORT" in result.stderr


def test_a_cluster_whose_workers_do_not_come_is_an_error(sweep_file, monkeypatch):
    monkeypatch.setattr(cluster, "_WORKERS_S", 0.01)
    with LocalCluster(
        n_workers=0, processes=False, host=HOST, protocol="tcp://", dashboard_address=None
    ) as empty:
        address = empty.scheduler_address
        with pytest.raises(
            SweepError, match=f"{address}: the cluster has no workers; start some with: dask worker"
        ):
            list(run(load(sweep_file), cluster_address=address))
