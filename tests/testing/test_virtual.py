"""Virtual modules for tests: time, lines, faults, bench."""

import asyncio
import socket
import threading
from types import SimpleNamespace

import can
import pytest
import serial

from tmcm34x.bench import BenchError
from tmcm34x.bench.action import ActionError
from tmcm34x.host import GarbledReplyError
from tmcm34x.links import LinkOpenError
from tmcm34x.links.faults import FaultError
from tmcm34x.testing import TooLateError, VirtualModule
from tmcm34x.testing.report import plot, report
from tmcm34x.tmcl.datagram import (
    Instruction,
    pack_can_request,
    pack_request,
    unpack_can_reply,
    unpack_reply,
)
from tmcm34x.tmcl.mnemonic import parse_instruction


@pytest.fixture
def module():
    with VirtualModule(343) as module:
        yield module


def telegram(text):
    return pack_request(1, parse_instruction(text))


def ask(port, text):
    """Status and value of a command over a pyserial port."""
    port.write(telegram(text))
    reply = unpack_reply(port.read(9))
    return reply.status, reply.value


# Time


def test_time_stands_still_until_the_test_moves_it(module):
    assert module.now == 0
    module.command("MVP ABS, 0, 50000")
    assert module.motor(0).position == 0
    module.run(1.5)
    assert module.now == 1.5
    assert module.motor(0).moving


def test_until_says_how_long_it_took(module):
    module.command("MVP ABS, 0, 5000")
    seconds = module.until(lambda: module.motor(0).at_target)
    assert 0.1 < seconds < 1
    assert module.motor(0).position == 5000


def test_until_takes_conditions_as_in_sessions(module):
    module.command("ROR 1, 500")
    module.until("motor 1 speed 500")
    module.until("GAP 1, 1 is 100 5000..6000")
    assert 5000 <= module.motor(1).position <= 6000


@pytest.mark.parametrize("condition", ["motor 1 turning", lambda: False])
def test_until_fails_when_the_time_is_over(module, condition):
    with pytest.raises(TooLateError, match="did not come true within 2 s"):
        module.until(condition, timeout=2)
    assert module.now == 2


@pytest.mark.parametrize("seconds", [-1, float("nan"), float("inf"), "2 s"])
def test_time_is_a_finite_number_of_seconds(module, seconds):
    with pytest.raises(ValueError, match="a time must be a finite number"):
        module.run(seconds)


@pytest.mark.parametrize("pace", [0, -1, "real", float("nan")])
def test_a_pace_is_virtual_or_a_factor(pace):
    with pytest.raises(ValueError, match="pace is 'virtual' or a factor"):
        VirtualModule(343, pace=pace)


@pytest.mark.parametrize("motor", [-1, 3, "left"])
def test_a_module_has_three_motors(module, motor):
    with pytest.raises(ValueError, match=r"motor is 0\.\.2, not"):
        module.motor(motor)


def test_there_are_three_models():
    with pytest.raises(ValueError, match="model is 341, 342, 343, not 344"):
        VirtualModule(344)


def test_at_real_pace_the_module_goes_on_by_itself():
    with VirtualModule(343, pace=50) as module:
        before = module.now
        module.command("MVP ABS, 0, 5000")
        module.until("GAP 8, 0 is 100 1", timeout=3000)
        assert module.now > before + 0.1
        assert module.motor(0).position == 5000
        before = module.now
        module.run(1)
        assert module.now >= before + 1


# The module


def test_parameters_are_attributes_of_a_motor(module):
    motor = module.motor(2)
    motor.max_speed = 700
    assert motor.max_speed == 700
    assert "max_speed" in dir(motor)
    with pytest.raises(ValueError, match="max_speed of motor 2: invalid value"):
        motor.max_speed = 5000
    with pytest.raises(AttributeError, match=r"no axis parameter 'max_sped'; did you mean max_speed\?"):
        _ = motor.max_sped
    with pytest.raises(AttributeError, match=r"no axis parameter 'colour'; dir\(motor\) lists them"):
        _ = motor.colour


def test_looking_does_not_change_the_run(module):
    with VirtualModule(343) as other:
        for each in (module, other):
            each.command("ROR 0, 300")
        for _ in range(10):
            _ = module.motor(0).load_value, module.motor(0).view, module.now
            module.run(0.1)
        other.run(1)
        random = [each.command("GGP 133, 0") for each in (module, other)]
    assert random[0] == random[1]


def test_a_program_is_assembled_stored_and_started(module, tmp_path):
    module.load("SIO 3, 2, 1\nSTOP\n", run=True)
    module.until("output 3 high", timeout=1)
    path = tmp_path / "program.tmc"
    path.write_text("MVP ABS, 0, 100\nSTOP\n")
    module.load(path, run=True)
    module.until("motor 0 at 100", timeout=1)
    with pytest.raises(ValueError, match=r"program:1:1: error.*no command FOO"):
        module.load("FOO 1\n")


def test_the_power_can_be_cycled(module):
    module.motor(0).max_speed = 33
    module.power_cycle()
    assert module.motor(0).max_speed != 33


# The bench


BENCH = """
[[module]]
[[module.axis]]
load = { kind = "carriage", start = 50.0, low = -5, high = 105 }
switch.left = { position = 0.0 }
switch.right = { position = 100.0 }
"""


def test_what_hangs_on_the_module_comes_from_a_bench_file(tmp_path):
    path = tmp_path / "bench.toml"
    path.write_text(BENCH)
    for bench in (path, str(path), BENCH):
        with VirtualModule(341, bench=bench) as module:
            assert module.model == 341
            assert module.motor(0).load_position == 50
    with pytest.raises(BenchError, match=r"gone\.toml"):
        VirtualModule(343, bench="gone.toml")
    with pytest.raises(BenchError, match="modul"):
        VirtualModule(343, bench="[[modul]]\n")


def test_switches_are_pressed_and_released(module):
    module.press("left", 0)
    assert module.motor(0).left_switch == 1
    module.release("left", 0)
    assert module.motor(0).left_switch == 0


def test_lost_steps_are_seen():
    with VirtualModule(343, bench=BENCH) as module:
        module.command("SAP 12, 0, 1")
        module.command("ROR 0, 1000")
        module.run(20)
        assert module.motor(0).lost_steps > 100
        assert module.motor(0).load_position == pytest.approx(105)


def test_inputs_take_levels(module):
    module.input(3, True)
    assert module.command("GIO 3, 0") == (100, 1)
    module.input(3, 100)
    assert module.command("GIO 3, 1") == (100, 100)


def test_what_a_bench_cannot_do_is_an_error(module):
    with pytest.raises(ActionError, match=r"motor is motor 0\.\.2"):
        module.press("left", 5)
    with pytest.raises(ActionError, match="no action 'shake'"):
        module.act("shake")


def test_a_snapshot_brings_a_state_back(module):
    module.command("MVP ABS, 0, 20000")
    module.run(0.3)
    snapshot, position = module.snapshot(), module.motor(0).position
    module.run(1)
    assert module.motor(0).position > position
    module.restore(snapshot)
    assert (module.motor(0).position, module.now) == (position, 0.3)
    module.until("motor 0 at 20000")
    with VirtualModule(343) as other:
        other.restore(snapshot)
        assert other.motor(0).position == position
    with VirtualModule(341) as other, pytest.raises(ValueError, match="of another bench"):
        other.restore(snapshot)


def test_a_module_on_usb_takes_any_address():
    with (
        VirtualModule(343, any_address=True) as module,
        serial.serial_for_url(module.serial_url, timeout=1) as port,
    ):
        port.write(pack_request(77, Instruction(6, 4)))
        assert unpack_reply(port.read(9)).value == 1000


# Lines


@pytest.fixture(params=["port", "serial_url"])
def line(request, module):
    with serial.serial_for_url(getattr(module, request.param), timeout=100) as port:
        yield port


def test_a_host_talks_to_it_over_pyserial(line):
    assert ask(line, "GAP 4, 0") == (100, 1000)


def test_a_host_that_polls_sees_the_move_end(module, line):
    ask(line, "MVP ABS, 0, 200000")
    polls = 0
    while ask(line, "GAP 8, 0") != (100, 1):
        polls += 1
    assert 100 < polls < 1000
    assert 5 < module.now < 20


def test_a_host_that_waits_for_the_second_reply_gets_it_at_once(module, line):
    ask(line, "MVP ABS, 0, 200000")
    assert ask(line, "138 0, 0, 1")[0] == 100
    assert unpack_reply(line.read(9)).status == 128
    assert module.motor(0).position == 200000


def test_the_telegram_pause_passes_in_virtual_time(module, line):
    ask(line, "SGP 75, 0, 255")
    before = module.now
    assert ask(line, "GAP 4, 0") == (100, 1000)
    assert module.now >= before + 0.255


def test_a_pause_of_the_host_counts(module, line):
    ask(line, "ROR 0, 500")
    before = module.now
    threading.Event().wait(0.02)
    ask(line, "GAP 1, 0")
    assert module.now >= before + 0.02


def test_a_line_inside_the_process_waits_in_virtual_time_alone(module):
    with serial.serial_for_url(module.serial_url, timeout=100) as port:
        assert port.read(1) == b""
        assert module.now == 100
        port.timeout = 0
        assert port.read(1) == b""
        port.write(telegram("GAP 4, 0"))
        assert port.in_waiting == 9
        port.reset_input_buffer()
        assert port.in_waiting == 0


def test_a_line_without_time_out_does_not_wait_for_ever(module):
    with (
        serial.serial_for_url(module.serial_url) as port,
        pytest.raises(serial.SerialException, match="no time-out"),
    ):
        port.read(1)


@pytest.mark.parametrize(
    ("url", "problem"),
    [
        ("tmcm34x://344", "expected tmcm34x://341, 342 or 343"),
        ("tmcm34x://343?bank=1", "unknown option bank; there are bench, pace, seed"),
        ("tmcm34x://343?bench=gone.toml", "gone.toml"),
        ("tmcm34x://343?seed=x", "seed is a whole number, not 'x'"),
        ("tmcm34x://343?pace=fast", "pace is 'virtual' or a factor of real time above 0, not 'fast'"),
        ("tmcm34x://343?pace=0", "pace is 'virtual' or a factor"),
    ],
)
def test_a_url_that_cannot_be_opened_says_why(module, url, problem):
    _ = module.serial_url
    with pytest.raises(serial.SerialException, match=problem):
        serial.serial_for_url(url)


def test_a_url_opens_a_module_of_its_own(module, tmp_path):
    _ = module.serial_url
    path = tmp_path / "bench.toml"
    path.write_text(BENCH)
    with serial.serial_for_url(f"tmcm34x://341?bench={path}&seed=7", timeout=1) as port:
        assert ask(port, "GAP 4, 0")[0] == 100
        assert (port.module.model, port.module.motor(0).load_position) == (341, 50)
    with pytest.raises(serial.SerialException):
        port.read(1)


def test_a_host_talks_to_it_over_tcp(module):
    host, port = module.address.split(":")
    assert module.url == f"tcp://{host}:{port}"
    with socket.create_connection((host, int(port))) as client:
        client.sendall(telegram("GAP 4, 0"))
        assert unpack_reply(client.recv(9)).value == 1000


def test_a_host_talks_to_it_over_can(module):
    with can.Bus(**module.can) as bus:
        data = pack_can_request(Instruction(6, 4, 0))
        bus.send(can.Message(arbitration_id=1, data=data, is_extended_id=False))
        assert unpack_can_reply(bus.recv(5).data).value == 1000
    assert module.now > 0


def test_the_host_library_talks_to_it_in_virtual_time(module):
    host = module.connect()
    host.axes[0].move_to(3000)
    module.until("motor 0 at 3000")
    assert host.axes[0].actual_position == 3000


def test_a_port_name_of_ones_own_is_taken_once(module, tmp_path):
    name = str(tmp_path / "tmcm")
    assert module.open_port(name) == name
    with VirtualModule(343) as other, pytest.raises(LinkOpenError, match="tmcm is already there"):
        other.open_port(name)


def test_a_host_that_never_reads_harms_nothing(module):
    with serial.Serial(module.port, timeout=0) as port:
        for _ in range(2000):
            port.write(telegram("GAP 4, 0"))
    module.run(1)
    assert module.motor(0).position == 0


def test_it_works_beside_a_running_event_loop(module):
    async def main():
        reader, writer = await asyncio.open_connection(*module.address.split(":"))
        writer.write(telegram("GAP 4, 0"))
        reply = unpack_reply(await reader.readexactly(9))
        writer.close()
        await writer.wait_closed()
        return reply.value

    assert asyncio.run(main()) == 1000


def test_nothing_is_left_running():
    before = threading.active_count()
    with VirtualModule(343) as module:
        _ = module.port, module.url
        assert threading.active_count() == before + 1
    assert threading.active_count() == before


# Faults


def test_a_fault_strikes_so_many_replies(module, line):
    module.fault("bad_checksum", count=2)
    for _ in range(2):
        line.write(telegram("GAP 4, 0"))
        with pytest.raises(ValueError, match="checksum"):
            unpack_reply(line.read(9))
    assert ask(line, "GAP 4, 0") == (100, 1000)


def test_faults_can_be_ended(module, line):
    module.fault("bad_checksum")
    module.fault("status", 5)
    module.clear_faults("bad_checksum")
    assert ask(line, "GAP 4, 0")[0] == 5
    module.clear_faults()
    assert ask(line, "GAP 4, 0") == (100, 1000)


def test_faults_reach_the_host_library(module):
    host = module.connect()
    module.fault("bad_checksum")
    with pytest.raises(GarbledReplyError):
        host.axes[0].move_to(3000)


def test_a_late_reply_comes_after_a_time_out(module):
    with serial.serial_for_url(module.serial_url, timeout=1) as port:
        module.fault("delay", 2000, count=1)
        port.write(telegram("GAP 4, 0"))
        assert port.read(9) == b""
        assert len(port.read(9)) == 9


def test_a_fault_that_does_not_exist_is_an_error(module):
    with pytest.raises(FaultError, match="there is no fault 'gremlin'"):
        module.fault("gremlin")


# The report


def test_the_report_shows_telegrams_state_and_a_plot(module):
    host = module.connect()
    host.axes[1].move_to(3000)
    module.press("right", 0)
    module.run(2)
    text = report(module)
    assert "MVP ABS, 1, 3000" in text
    assert "100 successfully executed, value 3000" in text
    assert "motor 0: position 0, target 0, speed 0, right switch active" in text
    assert "TMCM-343, outputs 00000000, program stopped" in text
    (moved,) = [line for line in plot(module).splitlines() if line.startswith("motor")]
    assert moved.startswith("motor 1 ")
    assert moved.endswith("█ 0..3000")


def test_two_runs_of_one_test_are_the_same(monkeypatch):
    """A pause of the host counts where it is no part of the test: the machine was busy with something else."""
    monkeypatch.setattr("tmcm34x.testing.lines.time", SimpleNamespace(monotonic=lambda: 1.0))

    def run():
        with VirtualModule(343, seed=5) as module, serial.serial_for_url(module.serial_url) as port:
            module.fault("garble", probability=0.3)
            port.timeout = 1
            return [port.write(telegram("GGP 133, 0")) and port.read(9) for _ in range(50)], module.now

    assert run() == run()
