"""`tmcm34x serve` as scripts and people use it."""

import os
import signal
import socket
import subprocess
import sys
import time
from pathlib import Path

import pytest

from conftest import PATIENCE_S
from tmcm34x.firmware.changes import ENTRY_SIZE
from tmcm34x.firmware.storage import Eeprom
from tmcm34x.server import EepromFile, Store
from tmcm34x.tmcl.datagram import Instruction, pack_request, unpack_reply

COMMAND = Path(sys.executable).with_name("tmcm34x")


class Socket:
    """A client over TCP."""

    def __init__(self, address):
        host, port = address.rsplit(":", 1)
        self.socket = socket.create_connection((host, int(port)), timeout=PATIENCE_S)

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.socket.close()

    def ask(self, *fields, address=1):
        self.socket.sendall(pack_request(address, Instruction(*fields)))
        reply = b""
        while len(reply) < 9:
            chunk = self.socket.recv(9 - len(reply))
            assert chunk, "hung up"
            reply += chunk
        return unpack_reply(reply)


def at_rest(client, position):
    """Whether motor 0 stands there; "position reached" alone comes a step too early."""
    return client.ask(6, 1, 0).value == position and client.ask(6, 3, 0).value == 0


def refused(*options):
    """The one line with which the command refuses to start."""
    result = subprocess.run(
        [COMMAND, "serve", *map(str, options)],
        capture_output=True,
        text=True,
        check=False,
        timeout=PATIENCE_S,
    )
    assert result.returncode == 2, result
    assert result.stderr.count("\n") == 1, result.stderr
    assert result.stderr.startswith("tmcm34x serve: ")
    return result.stderr.removeprefix("tmcm34x serve: ").rstrip("\n")


def test_each_link_has_its_ready_line(serve, tmp_path):
    served = serve("--pty", tmp_path / "one", "--tcp", 0, "--pty", "--tcp", "localhost:0", named=False)
    kinds, addresses = zip(*served.links, strict=True)
    assert kinds == ("pty", "pty", "tcp", "tcp")
    assert addresses[0] == str(tmp_path / "one")
    assert addresses[1].startswith("/dev/pts/")
    assert addresses[2].startswith("127.0.0.1:")


def test_without_a_link_there_is_a_pseudo_terminal(serve):
    assert serve().pty.startswith("/dev/pts/")


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGHUP])
def test_it_stops_cleanly_on_signals(serve, tmp_path, number):
    link = tmp_path / "module"
    served = serve("--pty", link, "--eeprom", tmp_path / "memory")
    assert link.is_char_device()
    served.stop(number)
    assert not link.is_symlink()


def test_clients_on_all_links_see_one_module(serve):
    served = serve("--tcp", 0, "--tcp", 0)
    (_, first), (_, second) = served.links
    with Socket(first) as a, Socket(second) as b, Socket(second) as c:
        a.ask(9, 0, 2, 1234)
        assert b.ask(10, 0, 2).value == c.ask(10, 0, 2).value == 1234


def test_model_addresses_and_seed(serve):
    def random_numbers(seed):
        served = serve("--tcp", 0, "--model", 341, "--address", 7, "--host-address", 9, "--seed", seed)
        with Socket(served.tcp) as client:
            version = client.ask(136, 1, address=7)
            assert (version.host, version.address) == (9, 7)
            assert version.value.to_bytes(4, "big")[:2] == (341).to_bytes(2, "big")
            return [client.ask(10, 133, 0, address=7).value for _ in range(3)]

    assert random_numbers(5) == random_numbers(5) != random_numbers(6)


@pytest.mark.parametrize("speed", [0.1, 1, 50])
def test_the_tick_timer_follows_the_speed(serve, speed):
    with Socket(serve("--tcp", 0, "--speed", speed).tcp) as client:
        before_s, start = time.monotonic(), client.ask(10, 132, 0).value
        after_s = time.monotonic()
        time.sleep(0.2)
        early_s, end = time.monotonic(), client.ask(10, 132, 0).value
        late_s = time.monotonic()
    assert speed * (early_s - after_s) * 1000 - 1 <= end - start <= speed * (late_s - before_s) * 1000 + 1


def test_a_move_takes_its_time(serve, wait_for):
    with Socket(serve("--tcp", 0).tcp) as client:
        start_s = time.monotonic()
        client.ask(4, 0, 0, 20_000)
        assert wait_for(lambda: at_rest(client, 20_000))
        assert time.monotonic() - start_s > 0.3


def test_at_speed_0_a_move_is_over_at_once(serve, wait_for):
    """It takes more than four minutes at the module's own pace."""
    with Socket(serve("--tcp", 0, "--speed", 0).tcp) as client:
        client.ask(4, 0, 0, 8_000_000)
        assert wait_for(lambda: at_rest(client, 8_000_000))


def test_the_memory_outlives_the_process(serve, tmp_path):
    path = tmp_path / "memory"
    served = serve("--tcp", 0, "--eeprom", path)
    assert Eeprom.from_bytes(path.read_bytes()).model == 343
    with Socket(served.tcp) as client:
        client.ask(9, 3, 2, 77)
        client.ask(11, 3, 2)
    served.stop()
    assert [entry.name for entry in tmp_path.iterdir()] == ["memory"]
    with Socket(serve("--tcp", 0, "--eeprom", path).tcp) as client:
        assert client.ask(10, 3, 2).value == 77


def test_the_image_is_written_soon_after_a_change(serve, tmp_path, wait_for):
    path = tmp_path / "memory"
    with Socket(serve("--tcp", 0, "--eeprom", path).tcp) as client:
        client.ask(9, 68, 0, 4321)
        assert wait_for(lambda: Eeprom.from_bytes(path.read_bytes()).global_values[68] == 4321)


def test_an_image_with_a_journal_is_taken_up(tmp_path):
    path, eeprom = tmp_path / "memory", Eeprom()
    file = EepromFile(path)
    Store(eeprom, file, print).begin()
    eeprom.set_global_value(68, 4321)
    file.close()
    assert len(path.read_bytes()) == len(Eeprom().to_bytes()) + ENTRY_SIZE
    path.write_bytes(path.read_bytes() + b"half an entry")
    with subprocess.Popen(
        [COMMAND, "serve", "--tcp", "0", "--eeprom", path],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    ) as process:
        with Socket(process.stdout.readline().split()[2]) as client:
            assert client.ask(10, 68, 0).value == 4321
        process.terminate()
        line = f"tmcm34x serve: {path}: left out 13 bytes at the end of a write that was never finished\n"
        assert (process.stderr.read(), process.wait(PATIENCE_S)) == (line, 0)


def test_a_memory_that_was_not_saved_is_known_at_the_end(tmp_path):
    path = tmp_path / "memory"
    path.write_bytes(Eeprom().to_bytes())
    script = (
        "import resource, signal, sys; from tmcm34x.cli import main\n"
        "signal.signal(signal.SIGXFSZ, signal.SIG_IGN)\n"
        "resource.setrlimit(resource.RLIMIT_FSIZE, (1000, 1000))\n"
        "sys.argv[1:] = ['serve', '--tcp', '0', '--eeprom', sys.argv[1]]\n"
        "main()\n"
    )
    # Not measured: what coverage writes would not fit either.
    environment = {name: value for name, value in os.environ.items() if not name.startswith("COVERAGE_")}
    with subprocess.Popen(
        [sys.executable, "-c", script, path],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        env=environment,
    ) as process:
        with Socket(process.stdout.readline().split()[2]) as client:
            assert client.ask(9, 68, 0, 4321).status == 100
        process.terminate()
        lines = process.stderr.read().splitlines()
        assert process.wait(PATIENCE_S) == 2
    assert lines == [
        f"tmcm34x serve: memory not saved: {path}: File too large; trying again every second",
        f"tmcm34x serve: the last memory was not saved: {path}: File too large",
    ]
    assert path.read_bytes() == Eeprom().to_bytes()


@pytest.mark.parametrize(
    ("content", "reason"),
    [
        (b"", "not an EEPROM image"),
        (b"PK\x03\x04 something else", "not an EEPROM image"),
        ("torn", "bytes instead"),
    ],
)
def test_a_foreign_or_torn_image_is_refused_and_left_alone(tmp_path, content, reason):
    path = tmp_path / "memory"
    path.write_bytes(Eeprom().to_bytes()[:-100] if content == "torn" else content)
    before = path.read_bytes()
    line = refused("--tcp", 0, "--eeprom", path)
    assert line.startswith(f"{path}: ")
    assert reason in line
    assert path.read_bytes() == before
    assert list(tmp_path.iterdir()) == [path]


def test_an_image_of_another_model_is_refused(tmp_path):
    path = tmp_path / "memory"
    path.write_bytes(Eeprom(342).to_bytes())
    assert refused("--eeprom", path) == "EEPROM image is of a TMCM-342, not of a TMCM-343"


def test_an_image_in_use_is_refused(serve, tmp_path):
    path = tmp_path / "memory"
    serve("--eeprom", path)
    assert refused("--eeprom", path) == f"{path}: in use by another process"


def test_a_missing_folder_is_refused():
    assert refused("--eeprom", "/no/such/folder/memory").startswith("/no/such/folder/memory: ")


def test_a_port_in_use_is_refused(serve):
    address = serve("--tcp", 0).tcp
    assert refused("--tcp", address) == f"cannot listen on {address}: Address already in use"


def test_a_link_path_that_is_taken_is_refused(tmp_path):
    path = tmp_path / "module"
    path.write_text("mine")
    assert refused("--tcp", 0, "--pty", path) == f"{path} is already there"
    assert path.read_text() == "mine"


def test_a_missing_serial_port_is_refused():
    assert refused("--serial", "/dev/no-such-port").startswith("cannot open /dev/no-such-port: ")


@pytest.mark.parametrize(
    "options",
    [
        ("--model", 340),
        ("--address", 256),
        ("--host-address", -1),
        ("--tcp", "nonsense"),
        ("--tcp", "localhost:65536"),
        ("--speed", -1),
        ("--speed", "fast"),
        ("--speed", "1e308"),
        ("--seed", "x"),
        ("--instruction-time", 0),
        ("--baud", 0),
        ("--no-such-option",),
        ("--log-telegrams", "/no/such/folder/log"),
        ("--program", "/no/such/program.tmc"),
        ("surplus",),
    ],
    ids=str,
)
def test_bad_values_are_refused(options):
    assert refused(*options)


def test_telegrams_are_written_down(serve, tmp_path):
    path = tmp_path / "log"
    served = serve("--tcp", 0, "--log-telegrams", path)
    with Socket(served.tcp) as client:
        client.ask(1, 0, 0, 350)
        client.ask(6, 77, 1)
    served.stop()
    lines = path.read_text().splitlines()
    assert [line.split(maxsplit=3)[3] for line in lines] == [
        ">  01 01 00 00 00 00 01 5e 61  to 1: ROR 0, 350",
        "<  02 01 64 01 00 00 01 5e c7  from 1: 100 successfully executed, value 350",
        ">  01 06 4d 01 00 00 00 00 55  to 1: GAP 77, 1",
        "<  02 01 03 06 00 00 00 00 0c  from 1: 3 wrong type, value 0",
    ]


def test_the_log_may_go_to_the_terminal(serve):
    served = serve("--tcp", 0, "--log-telegrams", "-")
    with Socket(served.tcp) as client:
        client.ask(10, 66, 0)
    assert "GGP 66, 0" in served.stop()


def test_a_log_that_nobody_reads_any_more_ends_it(serve):
    served = serve("--tcp", 0, "--log-telegrams", "-")
    served.process.stdout.close()
    with Socket(served.tcp) as client:
        client.socket.sendall(pack_request(1, Instruction(10, 66, 0)))
        assert served.process.wait(PATIENCE_S) == 1
    assert served.process.stderr.read() == ""


def test_a_log_on_a_full_disk_ends_it_with_one_line(serve):
    served = serve("--tcp", 0, "--log-telegrams", "/dev/full")
    with Socket(served.tcp) as client:
        client.socket.sendall(pack_request(1, Instruction(10, 66, 0)))
        assert served.process.wait(PATIENCE_S) == 2
    assert served.process.stderr.read() == "tmcm34x serve: telegram log: No space left on device\n"


def test_at_rest_it_takes_no_processor_time(serve):
    served = serve("--tcp", 0, "--pty")
    with Socket(served.tcp) as client:
        client.ask(6, 1, 0)
    before = cpu_ticks(served.process.pid)
    time.sleep(0.5)
    assert cpu_ticks(served.process.pid) - before <= 1


def cpu_ticks(pid):
    """Processor time of a process, in the ticks of a hundredth of a second in which it is counted."""
    fields = Path(f"/proc/{pid}/stat").read_text().rsplit(")", 1)[1].split()
    return int(fields[11]) + int(fields[12])


def test_it_fits_into_45_megabytes(serve):
    served = serve("--tcp", 0, "--pty")
    status = Path(f"/proc/{served.process.pid}/status").read_text()
    kib = next(int(line.split()[1]) for line in status.splitlines() if line.startswith("VmRSS"))
    assert kib * 1024 < 45e6


PROGRAM = "Loop: SGP 5, 2, 99\n  WAIT TICKS, 0, 1\n  JA Loop\n"


@pytest.mark.parametrize("image", [False, True])
def test_a_program_is_stored_and_started(serve, tmp_path, wait_for, image):
    path = tmp_path / "program.tmc"
    path.write_text(PROGRAM)
    if image:
        subprocess.run([COMMAND, "asm", path], check=True, capture_output=True)
        path = path.with_suffix(".bin")
    memory = tmp_path / "memory"
    served = serve("--tcp", 0, "--program", path, "--run", "--eeprom", memory)
    with Socket(served.tcp) as client:
        assert client.ask(135).value == 1
        assert wait_for(lambda: client.ask(10, 5, 2).value == 99)
    served.stop()
    assert Eeprom.from_bytes(memory.read_bytes()).read_instruction(2) == Instruction(22)


def test_a_program_with_mistakes_is_not_served(tmp_path):
    path = tmp_path / "program.tmc"
    path.write_text("MVP ABS, 0\n")
    result = subprocess.run(
        [COMMAND, "serve", "--program", path], capture_output=True, text=True, check=False, timeout=PATIENCE_S
    )
    assert result.returncode == 1
    assert "program.tmc:1:" in result.stderr


def test_the_modules_of_a_bench_have_memories_of_their_own(serve, tmp_path):
    bench = Path(__file__).parents[2] / "examples" / "benches" / "rs485.toml"
    one, two = tmp_path / "one", tmp_path / "two"
    served = serve("--tcp", 0, "--bench", bench, "--eeprom", one, "--eeprom", two)
    with Socket(served.tcp) as client:
        client.ask(9, 68, 0, 2222, address=2)
    served.stop()
    memories = [Eeprom.from_bytes(path.read_bytes()) for path in (one, two)]
    assert [memory.model for memory in memories] == [341, 342]
    assert [memory.global_values[66] for memory in memories] == [1, 2]
    assert [memory.global_values[68] for memory in memories] == [0, 2222]


def test_each_module_of_a_bench_has_a_line_of_its_own(serve, tmp_path):
    bench = tmp_path / "bench.toml"
    bench.write_text("[[module]]\nmodel = 341\n[[module]]\nmodel = 342\n[[module]]\nmodel = 343\n")
    served = serve("--bench", bench, "--each", "--pty", tmp_path / "line", "--tcp", 0)
    others = [served.process.stdout.readline().split()[1:] for _ in range(4)]
    kinds, addresses = zip(*served.links, *others, strict=True)
    assert kinds == ("pty", "tcp") * 3
    assert addresses[0::2] == tuple(str(tmp_path / f"line-{n}") for n in range(3))
    for address, model in zip(addresses[1::2], (341, 342, 343), strict=True):
        with Socket(address) as client:
            assert client.ask(136, 1, 0, 0).value >> 16 == model


@pytest.mark.parametrize(
    "options", [("--each",), ("--each", "--slcan"), ("--each", "--serial", "/dev/ttyS9", "--pty")]
)
def test_lines_of_single_modules_are_terminals_or_sockets(options):
    assert refused(*options) == "--each is for --pty and --tcp"


def test_there_are_not_more_ports_than_there_are(tmp_path):
    bench = tmp_path / "bench.toml"
    bench.write_text("[[module]]\n" * 3)
    assert refused("--bench", bench, "--each", "--tcp", 65534).startswith("there are no ports above 65535")


def test_what_a_bench_file_says_cannot_be_said_again(tmp_path):
    bench = tmp_path / "bench.toml"
    bench.write_text("[[module]]\nmodel = 341\n")
    assert refused("--bench", bench, "--model", 342) == "--model is for the bench file to say"
    assert "2 EEPROM files for 1 modules" in refused(
        "--bench", bench, "--eeprom", tmp_path / "a", "--eeprom", tmp_path / "b"
    )


@pytest.mark.parametrize("text", ["[[module]]\nmodel = 340\n", "nonsense", "[[module]]\nfriend = 1\n", None])
def test_a_bench_file_with_mistakes_is_refused_in_one_line(tmp_path, text):
    bench = tmp_path / "bench.toml"
    if text is not None:
        bench.write_text(text)
    assert refused("--bench", bench).startswith(f"{bench}: ")


def test_a_can_bus_that_is_not_there_is_refused():
    assert refused("--can", "socketcan:no-such-bus").startswith("cannot join socketcan:no-such-bus: ")
    assert refused("--can", "socketcan").startswith("Invalid value for '--can'")


def test_faults_and_pace_are_options(serve):
    served = serve(
        "--tcp", 0, "--pace", "--fault", "bad_checksum,count=1", "--fault", "status=4,after=1,count=1"
    )
    with Socket(served.tcp) as client:
        start_s = time.monotonic()
        with pytest.raises(ValueError, match="checksum"):
            client.ask(10, 66, 0)
        assert client.ask(10, 66, 0).status == 4
        assert client.ask(10, 66, 0).value == 1
        assert time.monotonic() - start_s >= 3 * 19 * 10 / 9600


@pytest.mark.parametrize("text", ["garbel", "status", "drop,count=none"])
def test_what_is_no_fault_is_refused(text):
    assert refused("--fault", text).startswith("Invalid value for '--fault'")


def test_any_address_is_for_one_module():
    bench = Path(__file__).parents[2] / "examples" / "benches" / "rs485.toml"
    assert refused("--bench", bench, "--any-address").startswith("--any-address is for one module")


def test_a_telegram_log_that_nobody_reads_holds_up_nothing():
    """Some 300 telegrams fill a pipe; whoever started the server as a child may never look into it."""
    process = subprocess.Popen(
        [COMMAND, "serve", "--tcp", "0", "--log-telegrams", "-"],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
    )
    with process:
        with Socket(process.stdout.readline().decode().split()[2]) as client:
            for _ in range(3000):
                assert client.ask(10, 66, 0).value == 1
        process.terminate()
        assert process.wait(PATIENCE_S) == 0
        process.stdout.close()


def test_more_connections_than_file_descriptors_end_nothing(tmp_path):
    limit = [
        "prlimit",
        "--nofile=64",
        COMMAND,
        "serve",
        "--tcp",
        "0",
        "--tcp",
        "0",
        "--eeprom",
        tmp_path / "memory",
    ]
    with subprocess.Popen(limit, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as process:
        addresses = [process.stdout.readline().split()[2] for _ in range(2)]
        with Socket(addresses[0]) as first:
            others = []
            for number in range(150):
                host, port = addresses[number % 2].rsplit(":", 1)
                others.append(socket.create_connection((host, int(port)), timeout=PATIENCE_S))
            assert first.ask(9, 68, 0, 77).status == 100
            for other in others:
                other.close()
            assert first.ask(10, 68, 0).value == 77
        process.terminate()
        assert process.wait(PATIENCE_S) == 0
        assert process.stderr.read().count("\n") <= 1


@pytest.mark.parametrize("speed", [1, 4, 7, 20])
def test_at_speed_0_a_slow_motor_keeps_no_host_waiting(serve, speed):
    """Its next event lies up to 550,000 seconds ahead."""
    with Socket(serve("--tcp", 0, "--speed", 0).tcp) as client:
        assert client.ask(1, 0, 0, speed).status == 100
        for _ in range(20):
            assert client.ask(6, 2, 0).value == speed
        assert client.ask(3, 0).status == 100


@pytest.mark.parametrize(("model", "value"), [(342, 42), (343, 43)])
def test_conditions_ask_for_the_model_that_is_served(serve, tmp_path, wait_for, model, value):
    path = tmp_path / "program.tmc"
    path.write_text("#if MODEL == 342\nSGP 10, 2, 42\n#else\nSGP 10, 2, 43\n#endif\nSTOP\n")
    served = serve("--tcp", 0, "--model", model, "--program", path, "--run")
    with Socket(served.tcp) as client:
        assert wait_for(lambda: client.ask(10, 10, 2).value == value)
