"""Lines by name: URLs, serial ports, sockets and CAN."""

import os
import sys
import threading
from contextlib import closing

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tmcm34x.bench import simple_rig
from tmcm34x.firmware.ports.can import CanPort
from tmcm34x.host import Connection, GarbledReplyError, LinkError, Module, RangeError, backup, connect, scan
from tmcm34x.host.can_line import serial_form
from tmcm34x.host.line import open_line
from tmcm34x.host.program import download
from tmcm34x.host.url import parse_url
from tmcm34x.tmcl.datagram import Instruction, Reply, pack_can_reply, unpack_reply
from tmcm34x.tmcl.global_parameters import BY_KEY as GLOBAL_KEYS
from tmcm34x.tmcl.mnemonic import parse_instruction

can = pytest.importorskip("can", reason="python-can is the extra `can`")

PATIENCE_S = 1.0
"""For replies of threads and processes on a busy machine."""


@pytest.mark.parametrize(
    ("text", "scheme", "target", "address"),
    [
        ("/dev/ttyUSB0", "serial", "/dev/ttyUSB0", 1),
        ("COM3", "serial", "COM3", 1),
        ("serial:COM3?address=0x10", "serial", "COM3", 16),
        ("serial:/dev/tty.usb?baud=115200&address=7", "serial", "/dev/tty.usb", 7),
        ("localhost:17000", "tcp", "localhost:17000", 1),
        ("tcp://[::1]:17000?address=4", "tcp", "[::1]:17000", 4),
        ("can:socketcan:can0?id=0x105&reply=2", "can", "socketcan:can0", 5),
        ("slcan:/dev/ttyACM0", "slcan", "/dev/ttyACM0", 1),
        ("virtual:", "virtual", "", 1),
        ("rfc2217://host:port?baud=19200", "serial", "rfc2217://host:port", 1),
        ("socket://host:7000", "serial", "socket://host:7000", 1),
    ],
)
def test_urls_are_taken_apart(text, scheme, target, address):
    url = parse_url(text)
    assert (url.scheme, url.target, url.address) == (scheme, target, address)


def test_defaults_hold_where_the_url_says_nothing():
    url = parse_url("serial:x?baud=19200", baud=9600, address=9, id=3)
    assert (url.baud, url.address) == (19200, 9)


@given(st.text(max_size=40))
def test_any_text_is_a_line_or_one_error(text):
    try:
        parse_url(text)
    except LinkError as error:
        assert "\n" not in str(error) or "\n" in text


@given(st.integers(0, 255), st.integers(-(2**31), 2**31 - 1), st.sampled_from([7, 8]))
def test_can_replies_get_the_serial_form(status, value, size):
    reply = Reply(2, 1, status, 6, value)
    assert unpack_reply(serial_form(6, pack_can_reply(reply, size), 2)) == reply
    assert serial_form(6, b"123456", 2) == b""


class Bus:
    """A module on a virtual bus of python-can."""

    def __init__(self, channel):
        self.rig = simple_rig(343)
        self.bus = can.Bus(interface="virtual", channel=channel)
        self.port = CanPort(self.rig.modules[0], self._send)
        self.over = False
        self.thread = threading.Thread(target=self._serve)
        self.thread.start()

    def _send(self, identifier, data):
        self.bus.send(can.Message(arbitration_id=identifier, data=data, is_extended_id=False))

    def _serve(self):
        while not self.over:
            frame = self.bus.recv(0.05)
            if frame is not None:
                self.port.receive_frame(frame.arbitration_id, bytes(frame.data))

    def execute(self, line):
        assert self.rig.modules[0].execute(parse_instruction(line))[0] == 100

    def stop(self):
        self.over = True
        self.thread.join()
        self.bus.shutdown()


@pytest.fixture
def bus(request):
    served = Bus(request.node.name)
    yield served
    served.stop()


def test_a_module_on_can_does_all_that_one_on_a_serial_line_does(bus, request):
    with connect(f"can:virtual:{request.node.name}?id=1&reply=2") as module:
        assert module.version == "343V4.36"
        module.axes[1].max_speed = 321
        assert module.axes[1].max_speed == 321
        saved = module.connection.run(backup.read())
        assert saved.complete


def test_a_line_on_can_follows_its_identifiers(bus, request):
    from tmcm34x.host import restore

    with Connection.open(f"can:virtual:{request.node.name}?id=1&reply=2") as connection:
        module = Module(connection)
        wanted = connection.run(backup.read())
        items = {item.key: item for item in wanted.present}
        for key, number in (("can_id", 0x123), ("can_reply_id", 0x77), ("serial_address", 9)):
            wanted.present[items[key]] = type(wanted.present[items[key]])(number)
        assert connection.run(restore.restore(wanted, connection.run(backup.read()))) == []
        assert connection.address == 0x23
        assert (module.can_id, module.can_reply_id, module.serial_address) == (0x123, 0x77, 9)


@pytest.mark.parametrize("reply", ["any", "0x7F"])
def test_a_module_on_can_is_found_whatever_its_identifiers(bus, request, reply):
    for key, number in (("can_reply_id", 0x7F), ("can_id", 0x105)):
        bus.execute(f"SGP {GLOBAL_KEYS[key].number}, 0, {number}")
    name = f"can:virtual:{request.node.name}?bitrate=1000000"
    attempts = scan.plan([name if reply == "any" else f"{name}&reply={reply}"], addresses=(0x104, 0x105))
    (found,) = scan.scan(attempts, pause_s=PATIENCE_S)
    assert (found.model, found.version, found.address) == (343, "V4.36", 5)
    with connect(found.url) as module:
        assert (module.can_id, module.can_reply_id) == (0x105, 0x7F)


def test_a_module_that_is_called_by_its_second_identifier_answers_with_its_first(bus, request):
    bus.execute("SGP 83, 0, 77")
    name = f"can:virtual:{request.node.name}?id=77&timeout=1&retries=0"
    with connect(f"{name}&address=1") as module:
        module.axes[2].max_speed = 99
        assert module.axes[2].max_speed == 99
    with pytest.raises(GarbledReplyError, match="give address=1 in the URL"), connect(name) as module:
        _ = module.axes[2].max_speed


def test_a_scan_finds_a_module_with_two_identifiers_once(bus, request):
    bus.execute("SGP 83, 0, 77")
    attempts = scan.plan([f"can:virtual:{request.node.name}?bitrate=1000000"], addresses=(1, 76, 77))
    (found,) = scan.scan(attempts, pause_s=PATIENCE_S)
    assert found.url.endswith("&id=1")


def test_a_scan_finds_a_module_whose_reply_comes_while_another_address_is_asked(serve):
    served = serve("--tcp", 0, "--fault", "late_reply,count=1")
    (found,) = scan.scan(scan.plan([f"tcp:{served.tcp}"], addresses=(1, 2)))
    assert found.url == f"tcp:{served.tcp}?address=1"


@pytest.mark.skipif(sys.platform == "win32", reason="there are no pseudo terminals")
def test_an_slcan_adapter_carries_all_that_a_serial_line_does(serve):
    path = dict(serve("--slcan").links)["slcan"]
    (found,) = scan.scan(scan.plan([f"slcan:{path}?bitrate=1000000"], addresses=(5, 1)), pause_s=PATIENCE_S)
    assert found.url == f"slcan:{path}?bitrate=1000000&reply=2&id=1"
    with connect(found.url) as module:
        assert module.version == "343V4.36"
        module.axes[1].max_speed = 321
        assert module.axes[1].max_speed == 321
        module.connection.run(download((Instruction(3, 0, 2), Instruction(28))))
        assert module.connection.run(backup.read()).complete


def test_a_bus_that_cannot_be_joined_is_one_line():
    with pytest.raises(LinkError, match="cannot join nonsense:x"):
        connect("can:nonsense:x")


def test_a_missing_python_can_is_said(monkeypatch):
    import sys

    monkeypatch.setitem(sys.modules, "can", None)
    with pytest.raises(LinkError, match="install tmcm34x with its extra `can`"):
        connect("can:virtual:x")


def test_a_serial_port_that_is_unplugged_is_said(serve):
    """A pseudo terminal whose other side goes away is what a pulled adapter is."""
    served = serve("--pty")
    with connect(f"serial:{served.pty}?timeout=10&retries=0") as module:
        assert module.version == "343V4.36"
        served.stop()
        with pytest.raises(LinkError, match="the port was disconnected"):
            module.connection.ask(Instruction(6, 1))


def test_a_speed_that_no_setting_reaches_is_refused_in_its_unit():
    with connect("virtual:343") as module:
        table = module.axes[0].physical(gear=2.0, pitch=5.0)
        with pytest.raises(
            RangeError, match=r"20 units/s is more than the 12\.\d+ units/s that pulse divisor 3"
        ):
            table.max_speed = 20.0
        with pytest.raises(RangeError, match="500 rev/min is more than"):
            table.max_speed_rev_min = 500
        assert module.axes[0].max_speed == 1000


def test_physical_units():
    with connect("virtual:343") as module:
        table = module.axes[0].physical(gear=2.0, pitch=5.0)
        table.max_speed = 2.0
        assert table.max_speed == pytest.approx(2.0, rel=0.01)
        table.max_speed_rev_min = 30.0
        assert table.max_speed_rev_min == pytest.approx(30, rel=0.01)
        table.max_acceleration = 5000.0
        assert table.max_acceleration == pytest.approx(5000, rel=0.01)
        table.max_current_ma = 550.0
        table.standby_current_ma = 110.0
        assert (table.max_current_ma, table.standby_current_ma) == (
            pytest.approx(550, abs=3), pytest.approx(110, abs=3),
        )  # fmt: skip
        table.move_to(1.25, wait=True)
        table.move_by(-0.25, wait=True)
        assert table.position == pytest.approx(1.0, abs=1e-3)
        assert table.axis.actual_position == round(1.0 / 5 * 2 * 12_800)
        table.axis.rotate(500)
        module.connection.wait(1)
        assert table.speed_rev_min == pytest.approx(60 / 5 * table.speed)
        assert table.speed_steps_s == pytest.approx(table.speed / 5 * 2 * 200)


@pytest.mark.skipif(sys.platform == "win32", reason="there are no pseudo terminals")
def test_a_port_without_room_takes_all_bytes_in_order():
    import tty

    theirs, ours = os.openpty()
    for end in (theirs, ours):
        tty.setraw(end)
    data = bytes(range(256)) * 256
    with closing(open_line(parse_url(f"serial:{os.ttyname(ours)}"))) as line:
        writer = threading.Thread(target=line.write, args=(data,))
        writer.start()
        read = b""
        while len(read) < len(data):
            read += os.read(theirs, 4096)
        writer.join()
    assert read == data
    os.close(theirs)
    os.close(ours)
