"""The commands that talk to a module, against a served one: what they print, and their exit statuses."""

import json
import os
import re
import signal
import socket
import subprocess
import sys
import threading
from pathlib import Path
from typing import NamedTuple

import pytest
from click.testing import CliRunner

from tmcm34x.cli import run
from tmcm34x.host import Connection, program
from tmcm34x.tmcl.datagram import Instruction

COMMAND = Path(sys.executable).with_name("tmcm34x")


class Result(NamedTuple):
    """Exit status and what was printed, standard output and error together."""

    exit_code: int
    output: str


def tmcm34x(*arguments, port=None, text=None):
    """Run a command in this process."""
    environment = {"TMCM34X_PORT": port}
    with CliRunner().isolation(input=text, env=environment) as (*_, output):
        status = run([str(each) for each in arguments])
        return Result(status, output.getvalue().decode())


@pytest.fixture
def port(serve):
    """A module on a socket, twenty times real time."""
    return f"tcp:{serve('--tcp', 0, '--speed', 20).tcp}"


VIRTUAL = "virtual:343"


# send


def test_send_takes_names_and_shows_values():
    result = tmcm34x("send", "GAP max_speed, 0", "GGP can_id, 0", "get_firmware_version", port=VIRTUAL)
    assert result.exit_code == 0
    assert result.output.splitlines() == ["GAP 4, 0: 1000", "GGP 71, 0: 1", "136 0, 0, 0: 343V4.36"]


def test_send_goes_on_after_a_refusal_and_says_so_in_its_status():
    result = tmcm34x("send", "SAP 4, 0, 5000", "GAP 4, 0", port=VIRTUAL)
    assert result.exit_code == 4
    assert result.output.splitlines() == ["SAP 4, 0, 5000: status 4, invalid value", "GAP 4, 0: 1000"]


def test_send_reads_files_and_standard_input(tmp_path):
    (tmp_path / "x.txt").write_text("GAP 4, 0 // speed\n\n// nothing\nGAP 5, 0\n")
    assert tmcm34x("send", "--file", tmp_path / "x.txt", port=VIRTUAL).output.count("1000") == 2
    assert tmcm34x("send", port=VIRTUAL, text="GAP 4, 1\n").output == "GAP 4, 1: 1000\n"


def test_send_shows_bytes_and_json():
    result = tmcm34x("send", "--hex", "GAP 4, 0", port=VIRTUAL)
    assert "> 01 06 04 00 00 00 00 00 0b\n< 02 01 64 06 00 00 03 e8 58\n" in result.output
    (row,) = json.loads(tmcm34x("send", "--json", "GAP 4, 0", port=VIRTUAL).output)
    assert (row["status"], row["value"]) == (100, 1000)


def test_send_as_json_says_what_was_done_before_a_command_without_a_reply(serve):
    served = serve("--tcp", 0, "--fault", "silent,after=2")
    result = tmcm34x(
        "send", "--json", "GAP 4, 0", "GAP 5, 0", "GAP 6, 0", port=f"tcp:{served.tcp}?timeout=1&retries=0"
    )
    text, _, last = result.output.rpartition("]\n")
    done, silent = (json.loads(f"{text}]")[index] for index in (0, -1))
    assert (result.exit_code, done["value"], silent["value"]) == (3, 1000, None)
    assert (last, silent["error"]) == (f"tmcm34x send: {silent['error']}\n", last[14:-1])


def test_send_as_json_is_json_where_no_reply_is_expected():
    (row,) = json.loads(tmcm34x("send", "--json", "137 0, 0, 1234", port=VIRTUAL).output)
    assert (row["received"], row["exit"]) == (None, 0)


@pytest.mark.parametrize(
    ("line", "message"),
    [
        ("GAP max_sped, 0", "there is no axis parameter max_sped; did you mean max_speed?"),
        ("GAPP 1, 0", "unknown command GAPP"),
        ("GAP 1", "GAP needs 2 operands"),
    ],
)
def test_send_refuses_what_is_no_command_before_anything_is_sent(line, message):
    result = tmcm34x("send", "SAP 4, 0, 5", line, port=VIRTUAL)
    assert result.exit_code == 2
    assert f"command 2, '{line}': {message}" in result.output


def test_what_acts_needs_a_word_on_a_port_that_may_be_real(port):
    result = tmcm34x("send", "ROR 0, 100", port=port)
    assert result.exit_code == 2
    assert "ROR 0, 100: may move a motor" in result.output
    assert "give --yes" in result.output
    assert tmcm34x("send", "GAP 2, 0", port=port).output == "GAP 2, 0: 0\n"
    assert tmcm34x("send", "--yes", "ROR 0, 100", "MST 0", port=port).exit_code == 0
    assert "writes the EEPROM" in tmcm34x("send", "STAP 4, 0", port=port).output
    assert "erases the program" in tmcm34x("send", "SGP code_protection, 0, 0", port=port).output


# The port


@pytest.mark.parametrize(
    ("url", "message"),
    [
        (None, "name the module with --port or TMCM34X_PORT"),
        ("serial:", "behind serial: comes the name of a port"),
        ("tcp:host", "behind tcp: comes HOST:PORT"),
        ("can:x", "behind can: comes INTERFACE:CHANNEL"),
        ("virtual:351", "behind virtual: comes 341, 342 or 343"),
        ("virtual:343?bench=/no/such.toml", "/no/such.toml"),
        ("virtual:343?adress=3", "virtual has no option 'adress'"),
        ("serial:/dev/x?address=300", "address is a number from 0 to 255, not '300'"),
        ("serial:/dev/x?timeout=0", "timeout is a number of seconds above 0"),
        ("serial:/dev/no-such-port", "cannot open /dev/no-such-port: No such file or directory"),
        ("tcp:127.0.0.1:1", "cannot connect to tcp:127.0.0.1:1: Connection refused"),
        ("nonsense://x", "cannot open nonsense://x"),
    ],
)
def test_a_port_that_cannot_be_used_is_one_line_and_status_2(url, message):
    result = tmcm34x("send", "GAP 1, 0", port=url)
    assert result.exit_code == 2
    assert message in result.output
    assert "Traceback" not in result.output


def test_no_reply_is_status_3_and_says_what_to_check():
    result = tmcm34x("send", "GAP 1, 0", port="virtual:343?timeout=0.1&baud=19200")
    assert result.exit_code == 3
    assert "no reply in time; check power, wiring, address and bit rate" in result.output
    result = tmcm34x("status", port="virtual:343?timeout=0.1&baud=19200")
    assert result.exit_code == 3


def test_a_line_that_talks_nonsense_is_status_3():
    with socket.create_server(("127.0.0.1", 0)) as server:

        def babble():
            client, _ = server.accept()
            with client:
                while client.recv(9):
                    client.sendall(bytes(range(40, 60)))

        thread = threading.Thread(target=babble)
        thread.start()
        url = f"tcp:127.0.0.1:{server.getsockname()[1]}?timeout=0.2&retries=0"
        result = tmcm34x("send", "GAP 1, 0", port=url)
        thread.join()
    assert result.exit_code == 3
    assert "check the bit rate, the wiring" in result.output


# Programs


def test_a_program_goes_in_and_comes_out_again(port, tmp_path):
    (tmp_path / "a.tmc").write_text("Loop: ROR 0, 100\nWAIT TICKS, 0, 10\nMST 0\nSTOP\n")
    assert tmcm34x("download", tmp_path / "a.tmc", port=port).exit_code == 2
    result = tmcm34x("download", tmp_path / "a.tmc", "--yes", port=port)
    assert (result.exit_code, result.output) == (0, "4 instructions stored and verified\n")
    assert tmcm34x("upload", "-o", tmp_path / "b.tmc", port=port).exit_code == 0
    assert tmcm34x("upload", "-o", tmp_path / "b.bin", port=port).exit_code == 0
    assert tmcm34x("asm", tmp_path / "b.tmc", "-o", tmp_path / "c.bin").exit_code == 0
    assert (tmp_path / "b.bin").read_bytes() == (tmp_path / "c.bin").read_bytes()
    assert "ROR" in tmcm34x("upload", port=port).output


def test_a_program_is_started_stepped_stopped_and_reset(port, tmp_path):
    (tmp_path / "a.tmc").write_text("Loop: WAIT TICKS, 0, 100\nJA Loop\n")
    assert tmcm34x("download", tmp_path / "a.tmc", "--yes", "--run", port=port).exit_code == 0
    assert "program running" in tmcm34x("start", "--yes", port=port).output
    assert "running" in tmcm34x("status", port=port).output
    again = tmcm34x("download", tmp_path / "a.tmc", port=port)
    assert "the running program is stopped" in again.output
    assert "program stopped" in tmcm34x("stop", "--all", port=port).output
    assert tmcm34x("step", "--yes", port=port).exit_code == 0
    assert "program stopped at address 0" in tmcm34x("reset", port=port).output


def test_a_dry_run_of_a_download_compares(port, tmp_path):
    file = tmp_path / "p.tmc"
    file.write_text("MST 0\nMST 1\n")
    result = tmcm34x("download", file, "--dry-run", port=port)
    assert (result.exit_code, result.output) == (1, "3 of 3 instructions differ; nothing is written\n")
    assert tmcm34x("upload", port=port).output == "0 instructions\n"
    assert tmcm34x("download", file, "--yes", port=port).exit_code == 0
    result = tmcm34x("download", file, "--dry-run", port=port)
    assert (result.exit_code, result.output) == (0, "the module holds these 3 instructions already\n")


def test_a_download_that_is_cut_says_how_much_is_stored(serve, tmp_path):
    file = tmp_path / "p.tmc"
    file.write_text("MST 0\n" * 99)
    served = serve("--tcp", 0, "--fault", "silent,after=30")
    result = tmcm34x("download", file, "--yes", port=f"tcp:{served.tcp}?timeout=1&retries=0")
    assert result.exit_code == 3
    assert re.search(
        r"; \d+ of 101 instructions are stored, so the program is not complete; download it again\n$",
        result.output,
    )


def test_settings_on_a_line_that_is_lost_say_how_many_are_set_or_stored(serve, tmp_path):
    file = tmp_path / "s.toml"
    tmcm34x("settings", "dump", file, port=VIRTUAL)
    for words, what in ((("load", file), "set"), (("store",), "stored")):
        served = serve("--tcp", 0, "--fault", "silent,after=30")
        result = tmcm34x("settings", *words, "--yes", port=f"tcp:{served.tcp}?timeout=1&retries=0")
        assert result.exit_code == 3
        assert re.search(rf"; (27|28) of \d+ values are {what}, the others are not\n$", result.output)


def test_a_program_with_mistakes_is_not_sent(port, tmp_path):
    (tmp_path / "a.tmc").write_text("RORR 0, 100\n")
    assert tmcm34x("download", tmp_path / "a.tmc", "--yes", port=port).exit_code == 1
    (tmp_path / "b.tmc").write_text("MST 0\n" * 2049)
    result = tmcm34x("download", tmp_path / "b.tmc", "--yes", port=port)
    assert result.exit_code in {1, 2}
    assert "2048" in result.output


MODEL_SOURCE = "#if MODEL == 342\n  MST 2\n#else\n  MST 0\n#endif\n"


@pytest.mark.parametrize(("model", "motor"), [(341, 0), (342, 2), (343, 0)])
def test_a_source_is_assembled_for_the_module_that_is_there(serve, tmp_path, model, motor):
    (tmp_path / "a.tmc").write_text(MODEL_SOURCE)
    port = f"tcp:{serve('--tcp', 0, '--model', model).tcp}"
    with Connection.open(port) as connection:
        connection.ask(Instruction(132))  # a module that is found in download mode says what it is too
    assert tmcm34x("download", tmp_path / "a.tmc", "--yes", port=port).exit_code == 0
    with Connection.open(port) as connection:
        assert connection.read_instruction(0) == Instruction(3, 0, motor)


def test_an_interrupted_download_leaves_the_module_usable(serve, tmp_path, wait_for):
    """The process is interrupted as by Ctrl+C; the module executes commands afterwards."""
    log = tmp_path / "log.txt"
    port = f"tcp:{serve('--tcp', 0, '--pace', '--log-telegrams', log).tcp}"
    (tmp_path / "a.tmc").write_text("WAIT TICKS, 0, 1\n" * 2000)
    process = subprocess.Popen(
        [COMMAND, "download", tmp_path / "a.tmc", "--yes"], env={**os.environ, "TMCM34X_PORT": port}
    )
    assert wait_for(lambda: "WAIT TICKS" in log.read_text())
    process.send_signal(signal.SIGINT)
    assert process.wait() == 130
    assert (
        tmcm34x("send", "GAP 4, 0", "GGP download_mode, 0", port=port).output
        == "GAP 4, 0: 1000\nGGP 129, 0: 0\n"
    )


def test_a_module_found_in_download_mode_is_freed_and_said(port):
    with Connection.open(port) as connection:
        connection.ask(Instruction(132))
    result = tmcm34x("send", "GAP 4, 0", port=port)
    assert result.exit_code == 4
    with Connection.open(port) as connection:
        connection.ask(Instruction(132))
    result = tmcm34x("stop", port=port)
    assert result.exit_code == 0
    assert "download mode" in result.output
    assert tmcm34x("send", "GAP 4, 0", port=port).exit_code == 0


LOOKING = (
    "status", "why", "monitor --csv --count 1", "settings dump", "backup x.toml --yes", "upload",
    "compare PORT PORT --yes", "settings store --yes", "settings load s.toml --yes", "factory-reset --yes",
    "start --yes", "step --yes", "reset", "download s.tmc --dry-run", "play s.session --port PORT --yes",
    "scan PORT --address 1",
)  # fmt: skip


@pytest.mark.parametrize("line", LOOKING)
def test_a_module_found_in_download_mode_is_asked_nothing_that_it_would_store(
    port, tmp_path, monkeypatch, line
):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "s.toml").write_text("[axis.0]\nmax_speed = 5\n")
    (tmp_path / "s.tmc").write_text("STOP\n")
    (tmp_path / "s.session").write_text("> GAP 4, 0\n< 100\n")
    with Connection.open(port) as connection:
        connection.run(program.download([Instruction(4, 0, 0, n) for n in range(20)]))
        connection.ask(Instruction(132))
    result = tmcm34x(*line.replace("PORT", port).split(), port=port)
    assert "Traceback" not in result.output
    if not line.startswith("scan"):
        assert "tmcm34x stop" in result.output
    if not line.startswith(("scan", "why", "play")):
        assert result.exit_code == 4
    with Connection.open(port) as connection:
        assert connection.ask(Instruction(135)).status == 6, "it is still in download mode"
        connection.run(program.stop())
        assert [connection.read_instruction(n).number for n in range(20)] == [4] * 20


def test_what_is_sent_to_a_module_in_download_mode_ends_with_the_first_command(port):
    with Connection.open(port) as connection:
        connection.ask(Instruction(132))
    result = tmcm34x("send", "GAP 4, 0", "GAP 5, 0", "GAP 6, 0", port=port)
    assert result.exit_code == 4
    assert result.output.count("\n") == 1
    assert "`tmcm34x stop`" in result.output and "2 more not sent" in result.output
    own = ["quit_download_mode", "start_download_mode", "GAP 4, 0", "STOP", "quit_download_mode"]
    result = tmcm34x("send", "--yes", *own, port=port)
    assert (result.exit_code, result.output.count("stored")) == (0, 2)


def test_a_protected_program_is_explained(port):
    tmcm34x("send", "--yes", "SGP code_protection, 0, 1", port=port)
    result = tmcm34x("upload", port=port)
    assert result.exit_code == 4
    assert "the program memory is protected against reading (global parameter 81)" in result.output


# Settings and backups


def test_settings_go_out_and_in(port, tmp_path):
    file = tmp_path / "s.toml"
    assert tmcm34x("settings", "dump", file, port=port).exit_code == 0
    file.write_text(file.read_text().replace("max_speed = 1000", "max_speed = 777", 1))
    result = tmcm34x("settings", "diff", file, port=port)
    assert (result.exit_code, result.output) == (1, "axis.0.max_speed: file 777, module 1000\n")
    assert tmcm34x("settings", "load", file, port=port).exit_code == 2
    assert tmcm34x("settings", "load", file, "--yes", port=port).exit_code == 0
    assert tmcm34x("settings", "diff", file, port=port).output == "equal\n"
    result = tmcm34x("settings", "store", file, "--yes", port=port)
    assert result.exit_code == 0
    assert "values stored" in result.output
    assert tmcm34x("settings", "dump", tmp_path / "s.tmc", port=port).exit_code == 0
    assert "SAP 4, 0, 777" in (tmp_path / "s.tmc").read_text()
    assert tmcm34x("settings", "diff", tmp_path / "s.tmc", port=port).exit_code == 0


@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "utf-16", "cp1252"])
def test_settings_of_the_vendors_tool_are_read_in_any_encoding(encoding, port, tmp_path):
    text = "//=== module settings for axis 0 ===\r\nSAP 4, 0, 777\t// top speed [\u00b5steps/s]\r\n"
    (tmp_path / "export.tmc").write_bytes(text.encode(encoding))
    result = tmcm34x("settings", "load", tmp_path / "export.tmc", "--yes", port=port)
    assert (result.exit_code, result.output) == (0, "1 of 1 values set\n")


def test_settings_that_are_refused_are_status_4(port, tmp_path):
    (tmp_path / "s.toml").write_text("[module]\nauto_start = 1\n")
    tmcm34x("send", "--yes", "SGP eeprom_lock, 0, 1234", port=port)
    result = tmcm34x("settings", "load", tmp_path / "s.toml", "--yes", port=port)
    assert result.exit_code == 4
    assert (
        "module.auto_start: SGP 77, 0, 1: status 5, configuration EEPROM locked: unlock it" in result.output
    )
    result = tmcm34x("settings", "store", "--yes", port=port)
    assert (result.exit_code, result.output.count("\n")) == (4, 1)
    assert "unlock it with SGP 73, 0, 4321" in result.output
    (tmp_path / "more.toml").write_text("[module]\nauto_start = 1\nshutdown_pin = 1\ncan_reply_id = 3\n")
    result = tmcm34x("settings", "load", tmp_path / "more.toml", "--yes", port=port)
    assert "module.auto_start and 1 more: status 5" in result.output


def test_settings_of_another_model_are_refused_unless_told(tmp_path):
    file = tmp_path / "s.toml"
    assert tmcm34x("settings", "dump", file, port="virtual:343").exit_code == 0
    result = tmcm34x("settings", "load", file, port="virtual:342")
    assert result.exit_code == 2
    assert "settings of a TMCM-343, and the module is a TMCM-342; give --other-model" in result.output
    result = tmcm34x("settings", "load", file, "--other-model", port="virtual:342")
    assert result.exit_code == 0
    assert "skipped: axis.0.max_current" in result.output


def test_backup_restore_clone_and_compare(serve, tmp_path):
    first, spare = (f"tcp:{serve('--tcp', 0, '--address', n).tcp}?address={n}" for n in (3, 9))
    tmcm34x("send", "--yes", "SAP 4, 1, 222", "STAP 4, 1", "SGP 5, 2, 77", "SGP can_id, 0, 40", port=first)
    file = tmp_path / "module.toml"
    assert tmcm34x("backup", file, port=first).exit_code == 2
    result = tmcm34x("backup", file, "--yes", port=first)
    assert (result.exit_code, result.output) == (0, f"{file}: complete\n")
    assert tmcm34x("compare", file, first, "--yes").output.startswith("equal: 447 values")
    assert tmcm34x("compare", first, spare, "--yes").exit_code == 1
    result = tmcm34x("clone", first, spare, "--yes")
    assert result.exit_code == 0, result.output
    assert "read back: equal in every row" in result.output
    assert tmcm34x("compare", file, spare.replace("address=9", "address=3"), "--yes").exit_code == 0
    rows = json.loads(tmcm34x("compare", "--json", file, "virtual:343").output)
    assert {"path": "axis.1.max_speed", "left": "222", "right": "1000"} in rows
    result = tmcm34x("restore", file, "--yes", port=first)
    assert result.output == "equal already: nothing is written\n"


def test_two_modules_on_one_line_do_not_get_one_address():
    result = tmcm34x("clone", "tcp:h:1?address=3", "tcp:h:1?address=9")
    assert result.exit_code == 2
    assert "would have the same address: give --keep-address" in result.output


def test_an_incomplete_backup_says_so_everywhere(port, tmp_path):
    tmcm34x("send", "--yes", "SGP code_protection, 0, 1", port=port)
    result = tmcm34x("backup", tmp_path / "x.toml", "--yes", port=port)
    assert result.exit_code == 1
    assert "INCOMPLETE, 1 not read" in result.output
    assert (tmp_path / "x.toml").read_text().startswith("# INCOMPLETE backup")
    result = tmcm34x("clone", tmp_path / "x.toml", VIRTUAL)
    assert result.exit_code == 2
    assert "the backup is not complete" in result.output


def test_an_incomplete_backup_does_not_replace_a_complete_one(port, tmp_path):
    file = tmp_path / "x.toml"
    assert tmcm34x("backup", file, "--yes", port=port).exit_code == 0
    complete = file.read_text()
    tmcm34x("send", "--yes", "SGP code_protection, 0, 1", port=port)
    result = tmcm34x("backup", file, "--yes", port=port)
    assert result.exit_code == 1
    assert f"{file}: holds a complete backup, and is left as it is" in result.output
    assert file.read_text() == complete
    assert (tmp_path / "x-incomplete.toml").read_text().startswith("# INCOMPLETE backup")


@pytest.mark.parametrize("command", ["restore", "clone"])
def test_a_dry_run_shows_the_differences_and_writes_nothing(port, tmp_path, command):
    file = tmp_path / "x.toml"
    tmcm34x("backup", file, port=VIRTUAL)
    tmcm34x("send", "--yes", "SAP 4, 0, 555", "SGP 5, 2, 9", port=port)
    words = ("restore", file) if command == "restore" else ("clone", file, port)
    result = tmcm34x(*words, "--dry-run", "--yes", port=port)
    assert result.exit_code == 1
    assert "axis.0.max_speed: backup 1000, module 555" in result.output
    assert result.output.endswith("2 differences; nothing is written\n")
    assert tmcm34x("send", "GAP 4, 0", "GGP 5, 2", port=port).output == "GAP 4, 0: 555\nGGP 5, 2: 9\n"


def test_a_pseudo_terminal_is_a_port_whatever_its_name(serve, tmp_path):
    link = tmp_path / "module"
    serve("--pty", link)
    file = tmp_path / "x.toml"
    tmcm34x("backup", file, port=VIRTUAL)
    assert tmcm34x("compare", file, link, "--yes").output.startswith("equal: 447 values")


def test_another_model_takes_what_both_have(serve, tmp_path):
    file, spare = tmp_path / "x.toml", f"tcp:{serve('--tcp', 0, '--model', 342).tcp}"
    tmcm34x("backup", file, port=VIRTUAL)
    file.write_text(file.read_text().replace("max_speed = 1000", "max_speed = 432"))
    result = tmcm34x("restore", file, "--other-model", "--yes", port=spare)
    assert result.exit_code == 0, result.output
    *lines, last = result.output.splitlines()
    (left_out,) = (line for line in lines if line.startswith("left out"))
    assert left_out.startswith("left out, because a TMCM-342 has other drivers: max_current, standby_current")
    assert left_out.endswith(", chip")
    assert last.startswith("read back: equal in every row")
    assert tmcm34x("send", "GAP 4, 2", port=spare).output == "GAP 4, 2: 432\n"


def test_a_backup_of_another_model_is_refused_unless_told(tmp_path):
    assert tmcm34x("backup", tmp_path / "x.toml", port="virtual:341").exit_code == 0
    result = tmcm34x("restore", tmp_path / "x.toml", port="virtual:343")
    assert result.exit_code == 2
    assert "the backup is of a TMCM-341, and the module is a TMCM-343" in result.output


OPERATIONS = {
    "backup FILE --yes": 60,
    "restore BACKUP --yes": 60,
    "clone virtual:343 PORT --yes": 60,
    "compare PORT virtual:343 --yes": 60,
    "settings dump": 60,
    "settings load SETTINGS --yes": 60,
    "settings diff SETTINGS": 60,
    "settings store --yes": 60,
    "download PROGRAM --yes": 60,
    "upload": 0,
    "monitor --csv --rate 100": 20,
    "why": 5,
    "status": 4,
    "console": 2,
    "start --yes": 1,
    "stop --all": 1,
    "step --yes": 1,
    "reset": 1,
    "factory-reset --yes": 3,
}
"""Commands, and how many replies they get before the line is cut."""


UNFINISHED = {
    "settings load": r" \d\d of \d+ values are set, the others are not",
    "settings store": r" \d\d of \d+ values are stored, the others are not",
    "download": r" \d\d of 202 instructions are stored, so the program is not complete; download it again",
}
"""What commands that change the module say of what they have done."""


@pytest.fixture(scope="module")
def files(tmp_path_factory):
    folder = tmp_path_factory.mktemp("files")
    names = {name: str(folder / f"{name.lower()}.toml") for name in ("BACKUP", "SETTINGS", "FILE")}
    assert tmcm34x("backup", names["BACKUP"], port=VIRTUAL).exit_code == 0
    assert tmcm34x("settings", "dump", names["SETTINGS"], port=VIRTUAL).exit_code == 0
    backup = Path(names["BACKUP"])
    backup.write_text(backup.read_text().replace("max_speed = 1000", "max_speed = 900"))
    (folder / "program.tmc").write_text("MST 0\n" * 200)
    return names | {"PROGRAM": str(folder / "program.tmc")}


LOST = {
    "tcp": ("the connection was lost", "is the other side still running"),
    "serial": ("the port was disconnected", "is it plugged in"),
}


@pytest.mark.parametrize("link", LOST)
@pytest.mark.parametrize("words", OPERATIONS)
def test_a_line_that_is_unplugged_in_the_middle_is_status_3(serve, files, words, link):
    option = ("--tcp", 0) if link == "tcp" else ("--pty",)
    served = serve(*option, "--fault", f"unplug,after={OPERATIONS[words]}")
    port = f"tcp:{served.tcp}" if link == "tcp" else served.pty
    arguments = [{**files, "PORT": port}.get(word, word) for word in words.split()]
    result = tmcm34x(*arguments, port=port, text="GAP 4, 0\n" * 10)
    *_, last = result.output.splitlines()
    assert result.exit_code == 3
    done = next((text for name, text in UNFINISHED.items() if words.startswith(name)), "")
    lost, check = LOST[link]
    assert re.search(rf": {lost} \(.+\); {check}\?{done}$", last)
    assert not Path(files["FILE"]).exists()


def test_a_port_that_another_host_uses_is_status_2(serve):
    served = serve("--pty")
    with Connection.open(served.pty):
        result = tmcm34x("status", port=served.pty)
    assert result.exit_code == 2
    assert "another program is using it" in result.output


def test_a_disk_that_is_full_loses_no_old_backup(tmp_path, monkeypatch):
    file = tmp_path / "x.toml"
    file.write_text("old")

    def full(*_):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "fsync", full)
    result = tmcm34x("backup", file, port=VIRTUAL)
    assert result.exit_code == 2
    assert "No space left on device; nothing is saved" in result.output
    assert [path.name for path in tmp_path.iterdir()] == ["x.toml"]
    assert file.read_text() == "old"


@pytest.mark.parametrize("arguments", [("settings", "load"), ("settings", "diff"), ("restore",)])
def test_files_that_cannot_be_used_are_one_line_and_status_2(arguments, tmp_path):
    for name, text, message in (
        ("missing.toml", None, "No such file or directory"),
        ("binary.toml", b"\xff\xfe\x00", "not UTF-16-LE at byte 2, as its byte order mark says"),
        ("wrong.toml", b"[axis.0]\nmax_speed = 'x'\n", "wrong.toml:"),
        ("syntax.toml", b"# x\n[axis.0\n", "syntax.toml:2: not TOML"),
    ):
        if text is not None:
            (tmp_path / name).write_bytes(text)
        result = tmcm34x(*arguments, tmp_path / name, port=VIRTUAL)
        assert result.exit_code == 2, result.output
        assert message in result.output


# Looking


def test_why_names_reasons_with_parameter_and_remedy(port):
    tmcm34x("send", "--yes", "SAP max_speed, 1, 0", "MVP ABS, 1, 1000", port=port)
    result = tmcm34x("why", "1", port=port)
    assert result.exit_code == 0
    assert (
        "motor 1: The maximum positioning speed is 0 (axis parameter 4 is 0). SAP 4, 1, 500." in result.output
    )
    rows = json.loads(tmcm34x("why", "--json", port=port).output)
    assert rows["1"][0]["shown_by"] == "axis parameter 4 is 0"


def test_the_monitor_writes_csv_and_draws_a_table():
    result = tmcm34x("monitor", "--csv", "--count", 3, "--motor", 1, port="virtual:342")
    head, *rows = result.output.splitlines()
    assert head.split(",")[:2] == ["time_s", "motor1.actual_position"]
    assert len(rows) == 3
    assert rows[0].split(",")[head.split(",").index("motor1.max_current")] == "n/a"
    result = tmcm34x("monitor", "--count", 2, "--plot", "--drivers", port=VIRTUAL)
    assert result.exit_code == 0
    assert "actual position" in result.output
    assert "speed 0" in result.output


def test_a_scan_finds_a_module_whose_address_is_forgotten(serve):
    served = serve("--tcp", 0, "--address", 23)
    result = tmcm34x(
        "scan", f"tcp:{served.tcp}", "--first", "--wait", 1, *(f"--address={n}" for n in range(20, 26))
    )
    assert result.exit_code == 0
    assert result.output == f"tcp:{served.tcp}?address=23  TMCM-343 V4.36, address 23\n"
    assert tmcm34x("send", "GAP 4, 0", port=f"tcp:{served.tcp}?address=23").exit_code == 0


def test_a_scan_lists_a_module_on_a_port_without_a_bit_rate_once(serve):
    served = serve("--pty", "--speed", 20)
    result = tmcm34x("scan", served.pty, "--address", 1, "--wait", 1)
    assert result.output == f"serial:{served.pty}?baud=9600&address=1  TMCM-343 V4.36, address 1\n"


def test_a_scan_finds_a_module_whose_bit_rate_is_forgotten(serve):
    served = serve("--pty", "--tcp", 0, "--strict-baud")
    with Connection.open(f"tcp:{served.tcp}") as connection:
        connection.command(9, 65, 0, 7)
    result = tmcm34x(
        "scan",
        "--json",
        f"serial:{served.pty}",
        "--address",
        1,
        "--baud",
        9600,
        "--baud",
        115200,
        "--wait",
        1,
    )
    assert [row["url"] for row in json.loads(result.output)] == [f"serial:{served.pty}?baud=115200&address=1"]


def test_a_scan_without_modules_is_status_1(serve):
    served = serve("--tcp", 0)
    result = tmcm34x("scan", f"tcp:{served.tcp}", "--address", 7)
    assert result.exit_code == 1
    assert "no module replies" in result.output


def test_factory_settings(port):
    tmcm34x("send", "--yes", "SGP serial_address, 0, 5", port=port)
    result = tmcm34x("factory-reset", port=f"{port}?address=5")
    assert result.exit_code == 2
    assert "loses all its settings" in result.output
    result = tmcm34x("factory-reset", "--yes", port=f"{port}?address=5")
    assert (result.exit_code, result.output) == (0, "343V4.36: factory settings, address 1\n")


def test_units_need_no_module():
    result = tmcm34x("units", "--json", "--rev-min", 300, "--ramp", 0.5, "--distance", 360)
    rows = json.loads(result.output)
    assert rows["speed_rev_min"] == pytest.approx(300, rel=0.01)
    assert rows["ramp"] == pytest.approx(0.5, rel=0.01)
    assert rows["brakes_exactly"] is True
    assert rows["distance"] == 12_800
    assert tmcm34x("units", "--rev-min", 300).exit_code == 2
    result = tmcm34x("units", "--rev-min", 900_000, "--ramp", 1)
    assert result.exit_code == 2
    assert "no divisors reach" in result.output
    assert "NO: the move overshoots" in tmcm34x("units", "--ramp-divisor", 13, "--acceleration", 1).output


@pytest.mark.parametrize(
    ("words", "setting", "milliamperes"),
    [
        ((), 128, 1100 * 128 / 255),
        (("--current", 255), 255, 1100),
        (("--current-ma", 500), 116, 1100 * 116 / 255),
        (("--model", 341), 128, None),
        (("--model", 341, "--largest-ma", 4000, "--current-ma", 1000), 64, 4000 * 64 / 255),
    ],
)
def test_units_of_currents_follow_the_model(words, setting, milliamperes):
    rows = json.loads(tmcm34x("units", "--json", *words).output)
    assert (rows["max_current"], rows["current"]) == (setting, milliamperes and pytest.approx(milliamperes))


@pytest.mark.parametrize(
    ("words", "text"),
    [
        (("--current-ma", 1200), "1200 mA are more than the 1100 mA of setting 255"),
        (("--model", 342, "--current-ma", 100), "not known; give --largest-ma"),
        (("--current", 256), "is not in the range 0<=x<=255"),
    ],
)
def test_currents_that_no_setting_makes_are_refused(words, text):
    result = tmcm34x("units", *words)
    assert result.exit_code == 2
    assert text in result.output


def test_the_console_sends_explains_and_ends():
    lines = (
        "GAP max_speed, 0", "help max_speed", "help MVP", "GAP nonsense, 0", "hex on", "GAP ramp_mode, 0", "units 0",
        "units 7", "help", "quit",
    )  # fmt: skip
    result = tmcm34x("console", port=VIRTUAL, text="\n".join(lines))
    assert result.exit_code == 0
    for text in (
        "343V4.36 at virtual:343",
        "1000 velocity units",
        "4 maximum positioning speed, 0..2047 velocity units",
        "MVP ABS|REL|COORD, <motor>, <position>: Starts a move",
        "there is no axis parameter nonsense",
        "> 01 06 8a 00",
        "0 position",
        "max_speed: 1000 = 476.837 full steps/s = 143.051 rev/min",
        "with a motor of 0..2",
        "Ctrl+D",
    ):
        assert text in result.output


def test_the_console_speaks_the_ascii_interface():
    result = tmcm34x("console", port=VIRTUAL, text="ascii\nAGAP 4, 0\nABIN\nGAP 4, 0\n")
    assert "BA 100 1000" in result.output
    assert result.output.rstrip().endswith("1000 velocity units")


def test_completion_knows_commands_parameters_and_words():
    from tmcm34x.cli.host.console import completions

    assert "GAP" in completions("GA", "GA")
    assert completions("max_s", "GAP max_s") == ["max_speed"]
    assert completions("can_b", "SGP can_b") == ["can_bit_rate"]
    assert completions("a", "MVP a") == ["ABS"]
    assert completions("enter", "enter") == ["enter_ascii_mode"]


@pytest.mark.parametrize(
    ("words", "expected"),
    [
        ("res", ["reset", "restore"]),
        ("restore --dry", ["--dry-run"]),
        ("status --port virtual:34", ["virtual:341", "virtual:342", "virtual:343"]),
    ],
)
def test_the_shell_completes_commands_options_and_ports(words, expected):
    environment = {"COMP_WORDS": f"tmcm34x {words}", "COMP_CWORD": str(len(words.split()))}
    environment["_TMCM34X_COMPLETE"] = "bash_complete"
    found = subprocess.run(
        [COMMAND], check=True, env={**os.environ, **environment}, stdout=subprocess.PIPE, text=True
    )
    assert [line.removeprefix("plain,") for line in found.stdout.splitlines()] == expected


@pytest.mark.parametrize("shell", ["zsh", "fish"])
def test_the_completion_script_asks_this_program(shell):
    assert f"_TMCM34X_COMPLETE={shell}_complete" in tmcm34x("completion", shell).output
