"""`tmcm34x record`, `show` and `check`, with hosts of others in front of served modules."""

import os
import signal
import subprocess
import threading
from contextlib import contextmanager

import can
import pytest
import serial
from can.interfaces import virtual
from click.testing import CliRunner
from pytrinamic.connections import ConnectionManager
from pytrinamic.tmcl import TMCLReplyStatusError

from conftest import COMMAND
from tmcm34x.bench import simple_rig
from tmcm34x.capture import files, session_file
from tmcm34x.cli import run as command_line
from tmcm34x.firmware.ports.can import CanPort
from tmcm34x.host import Connection, Module, RefusedError
from tmcm34x.tmcl.datagram import Instruction, pack_can_request, pack_request
from tmcm34x.tmcl.mnemonic import parse_instruction


def run(*arguments):
    return subprocess.run([COMMAND, *map(str, arguments)], capture_output=True, text=True, check=False)


@contextmanager
def recording(out, *options):
    """`tmcm34x record` at work; gives the address on its ready line, and its process."""
    command = [COMMAND, "record", *map(str, (out, *options))]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as process:
        ready = process.stdout.readline().split()
        if ready[:1] != ["ready"]:
            raise AssertionError(process.communicate())
        try:
            yield ready[2], process
        finally:
            if process.poll() is None:
                process.send_signal(signal.SIGINT)
                output, errors = process.communicate(timeout=60)
                assert (process.returncode, errors) == (0, ""), output


def drive(host):
    """A host at work: moves, polls, sets, is refused."""
    assert host.get_version_string() == "343V4.36"
    host.set_axis_parameter(4, 0, 800)
    host.move_to(0, 3000)
    for _ in range(200):
        host.get_axis_parameter(1, 0, signed=True)
        if host.get_axis_parameter(8, 0):
            break
    with pytest.raises(TMCLReplyStatusError):
        host.set_axis_parameter(4, 0, 9999)
    host.set_global_parameter(5, 2, -77)
    assert host.get_global_parameter(5, 2, signed=True) == -77


@pytest.mark.parametrize("suffix", [".session", ".pcapng"])
def test_what_pytrinamic_says_to_a_served_module_replays_without_a_difference(serve, tmp_path, suffix):
    out = tmp_path / f"out{suffix}"
    served = serve("--tcp=0", "--record", out)
    with ConnectionManager(f"--interface socket_serial_tmcl --port {served.tcp}").connect() as host:
        drive(host)
    served.stop()
    result = run("check", "--strict", out)
    assert (result.returncode, result.stderr) == (0, ""), result.stdout
    assert result.stdout.endswith(" requests, no difference\n")
    assert run("check", "--strict", "--model", "341", out).returncode == 1, "another version"


@pytest.mark.filterwarnings("ignore:.*ttyBaudrate:DeprecationWarning")
def test_what_an_slcan_client_says_replays_without_a_difference(serve, tmp_path):
    out = tmp_path / "out.session"
    served = serve("--slcan", "--record", out)
    path = served.links[0][1]
    with can.Bus(interface="slcan", channel=path, bitrate=1_000_000, sleep_after_open=0) as bus:
        for text in ("GAP 4, 0", "MVP ABS, 1, 2000", "GAP 1, 1", "GAP 77, 0", "SGP 3, 2, 5", "GGP 3, 2"):
            for size in (7, 8):
                data = pack_can_request(parse_instruction(text), size)
                bus.send(can.Message(arbitration_id=1, data=data, is_extended_id=False))
                assert bus.recv(60) is not None
    served.stop()
    result = run("check", "--strict", out)
    assert (result.returncode, result.stdout) == (0, "12 requests, no difference\n")
    assert run("play", out, "--model", "343").returncode == 0, "a recording is a session"


def test_a_host_and_a_module_on_tcp_are_recorded(serve, tmp_path):
    out = tmp_path / "out.session"
    served = serve("--tcp=0", "--speed", "20")
    with (
        recording(out, "--tcp", "0", "--to", f"tcp://{served.tcp}") as (address, _),
        ConnectionManager(f"--interface socket_serial_tmcl --port {address}").connect() as host,
    ):
        drive(host)
    text = out.read_text()
    assert " > MVP ABS, 0, 3000\n" in text
    assert " < 4 9999\n" in text
    result = run("check", out)
    assert (result.returncode, result.stderr) == (0, ""), result.stdout


def test_what_a_host_does_through_the_recorder_replays_to_the_letter(serve, tmp_path):
    """Settings, a move that is over before it is looked at, and refusals do not depend on the moment."""
    out = tmp_path / "out.session"
    served = serve("--tcp=0")
    with (
        recording(out, "--tcp", "0", "--to", f"tcp://{served.tcp}") as (address, _),
        Connection.open(f"tcp:{address}") as connection,
    ):
        module = Module(connection)
        module.axes[0].max_speed = 2000
        module.axes[0].move_to(3000)
        module.variables[7] = 5
        connection.wait(1.0)
        assert (module.axes[0].actual_position, module.variables[7]) == (3000, 5)
        with pytest.raises(RefusedError):
            connection.command(5, 4, 0, 9999)
    result = run("check", "--strict", out)
    assert (result.returncode, result.stdout) == (0, "6 requests, no difference\n")


@contextmanager
def conversing(channel, commands):
    """A module and a host on a virtual bus that begin when a third one has joined, and interrupt it at the end."""
    module, host = (can.Bus(interface="virtual", channel=channel) for _ in range(2))
    port = CanPort(
        simple_rig().modules[0],
        lambda identifier, data: module.send(
            can.Message(arbitration_id=identifier, data=data, is_extended_id=False)
        ),
    )

    def work():
        while len(virtual.channels[channel]) < 3:
            threading.Event().wait(0.01)
        for text in commands:
            data = pack_can_request(parse_instruction(text))
            host.send(can.Message(arbitration_id=1, data=data, is_extended_id=False))
            request = module.recv(60)
            port.receive_frame(request.arbitration_id, bytes(request.data))
            assert host.recv(60) is not None
        os.kill(os.getpid(), signal.SIGINT)

    thread = threading.Thread(target=work)
    thread.start()
    try:
        yield
    finally:
        thread.join()
        module.shutdown()
        host.shutdown()


@pytest.mark.parametrize("suffix", [".log", ".session", ".pcapng"])
def test_the_frames_of_a_bus_are_recorded(tmp_path, suffix):
    out = tmp_path / f"out{suffix}"
    commands = ("GAP 4, 0", "SGP 3, 2, 5", "GGP 3, 2", "GAP 77, 0")
    with conversing(f"record-{suffix}", commands), CliRunner().isolation() as (*_, output):
        assert command_line(["record", str(out), "--to", f"can:virtual:record-{suffix}"]) == 0
    assert output.getvalue().decode().endswith("8 records\n")
    assert [record.direction for record in files.read(out)] == [">", "<"] * 4
    result = run("check", "--strict", out)
    assert (result.returncode, result.stdout) == (0, "4 requests, no difference\n")


def test_a_host_and_a_module_on_serial_ports_are_recorded(serve, tmp_path):
    out = tmp_path / "out.pcapng"
    served = serve("--pty")
    with recording(out, "--pty", "--to", served.pty) as (path, _), serial.Serial(path, timeout=60) as port:
        port.write(pack_request(1, Instruction(6, 4)))
        assert len(port.read(9)) == 9
    records = files.read(out)
    assert [record.direction for record in records] == [">", "<"]
    assert run("check", out).stdout == "1 request, no difference\n"


@pytest.mark.filterwarnings("ignore:.*ttyBaudrate:DeprecationWarning")
def test_a_host_and_an_slcan_adapter_are_recorded(serve, tmp_path):
    out = tmp_path / "out.session"
    adapter = serve("--slcan").links[0][1]
    options = ("--pty", "--to", adapter, "--slcan")
    with (
        recording(out, *options) as (path, _),
        can.Bus(interface="slcan", channel=path, bitrate=1_000_000, sleep_after_open=0) as bus,
    ):
        for text in ("GAP 4, 0", "SGP 3, 2, 5", "GGP 3, 2", "GAP 77, 0"):
            data = pack_can_request(parse_instruction(text))
            bus.send(can.Message(arbitration_id=1, data=data, is_extended_id=False))
            assert bus.recv(60) is not None
    assert "# links: can\n" in out.read_text()
    assert run("check", out).stdout == "4 requests, no difference\n"


def test_the_end_of_the_modules_side_ends_the_recording(serve, tmp_path):
    served = serve("--tcp=0")
    with recording(tmp_path / "out.hex", "--tcp", "0", "--to", f"tcp://{served.tcp}") as (_, process):
        served.stop()
        output, errors = process.communicate(timeout=60)
    assert process.returncode == 1
    assert errors == "tmcm34x record: the module's side has hung up\n"
    assert output.endswith("out.hex: 0 records\n")


@pytest.mark.parametrize(
    ("options", "problem"),
    [
        (("out.doc", "--to", "tcp://127.0.0.1:1"), "recordings are .session"),
        (("no/out.hex", "--to", "tcp://127.0.0.1:1"), "No such file"),
        (("out.hex", "--to", "tcp://127.0.0.1:1"), "cannot connect to 127.0.0.1:1"),
        (("out.hex", "--to", "/dev/nothing"), "cannot open /dev/nothing"),
        (("out.hex", "--to", "tcp:here"), "expected a serial port or tcp://HOST:PORT"),
        (("out.hex",), "Missing option '--to'"),
    ],
)
def test_what_cannot_be_recorded_is_told_in_a_line(tmp_path, monkeypatch, options, problem):
    monkeypatch.chdir(tmp_path)
    result = run("record", *options)
    assert (result.returncode, result.stdout) == (2, "")
    assert problem in result.stderr
    assert "Traceback" not in result.stderr


# Show


RECORDING = """== a recording
0.000 > GAP 4, 0
0.002 < 100 1000
0.100 > GAP 6, 0
0.103 < 100 99
0.200 > GAP 1, 0
0.203 < 100 77
0.300 > GAP 5, 0
"""


@pytest.fixture
def made(tmp_path):
    path = tmp_path / "made.session"
    path.write_text(RECORDING)
    return path


def test_a_recording_is_shown_with_meanings_and_latencies(made):
    result = run("show", made)
    first, second, *_, last = result.stdout.splitlines()
    assert first == "     0.000000 s > 01 06 04 00 00 00 00 00 0b                GAP 4, 0"
    assert second == (
        "     0.002000 s < 02 01 64 06 00 00 03 e8 58      2.000 ms  100 successfully executed, value 1000"
    )
    assert last == "4 requests, 3 replies, latency 2.000 ms to 3.000 ms, median 3.000 ms"


def test_a_recording_is_written_in_another_form(made, tmp_path):
    out = tmp_path / "out.pcapng"
    assert run("show", made, "--to", out).stdout == f"{out}: 7 records\n"
    again = tmp_path / "again.session"
    run("show", out, "--to", again)
    assert session_file.read(again.read_text(), again) == session_file.read(RECORDING, made)
    result = run("show", made, "--to", tmp_path / "out.log")
    assert "7 left out: candump takes CAN frames only" in result.stdout


def test_the_dissector_is_printed():
    assert run("show", "--dissector").stdout.startswith("-- TMCL of TMCM-341")


@pytest.mark.parametrize("command", ["show", "check"])
def test_a_recording_that_is_not_there_is_told_in_a_line(command):
    result = run(command, "gone.session")
    assert (result.returncode, result.stderr) == (
        2,
        f"tmcm34x {command}: gone.session: No such file or directory\n",
    )
    assert run("show").returncode == 2


# Check


def test_differences_are_listed_with_the_entries_they_touch(made):
    result = run("check", made)
    assert result.returncode == 1
    lines = result.stdout.splitlines()
    assert lines[0].startswith(
        "    0.103000 s  GAP 6, 0: recorded 100 successfully executed, value 99 [02 01"
    )
    assert "ours 100 successfully executed, value 128" in lines[0]
    assert all("touches " in line for line in lines[1:4])
    assert "recorded no reply, ours 100" in result.stdout
    assert (
        lines[-1] == "4 requests, 2 differences, 1 value that may differ because of the time of the request"
    )
    assert "3 differences" in run("check", made, "--strict").stdout


def test_a_recording_is_compared_on_a_bench_and_with_a_memory(tmp_path):
    recorded = tmp_path / "a.session"
    recorded.write_text("== a\n0.0 > GIO 3, 0\n0.1 < 100 1\n")
    bench = tmp_path / "bench.toml"
    bench.write_text('[[module]]\ninput.IN_3 = {kind = "constant", value = 1023}\n')
    assert run("check", recorded).returncode == 1
    assert run("check", recorded, "--bench", bench).returncode == 0
    (tmp_path / "memory").write_bytes(b"rubbish")
    result = run("check", recorded, "--eeprom", tmp_path / "memory")
    assert (result.returncode, result.stdout) == (2, "")
    assert "memory: " in result.stderr
