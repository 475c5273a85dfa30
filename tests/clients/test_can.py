"""CAN clients: PyTrinamic and python-can through an SLCAN adapter, and python-can on a bus of its own."""

import asyncio
from pathlib import Path

import can
import pytest
import serial
from pytrinamic.connections import ConnectionManager
from pytrinamic.modules import TMCM3110
from pytrinamic.tmcl import TMCLReplyStatusError

from conftest import PATIENCE_S
from tmcm34x.bench import simple_rig
from tmcm34x.links import LinkOpenError
from tmcm34x.links.can import CanBusLink
from tmcm34x.server import Server

BENCHES = Path(__file__).parents[2] / "examples" / "benches"


@pytest.mark.filterwarnings("ignore:.*ttyBaudrate:DeprecationWarning")
def test_pytrinamic_drives_three_axes_over_slcan(serve, wait_for):
    path = serve("--slcan", "--speed", 20).links[0][1]
    with ConnectionManager(f"--interface slcan_tmcl --port {path}").connect() as host:
        assert host.get_axis_parameter(4, 0) == 1000
        for axis in range(3):
            host.move_to(axis, -2000 * (axis + 1))
        assert wait_for(lambda: all(host.get_axis_parameter(8, axis) for axis in range(3)))
        assert host.get_axis_parameter(1, 2, signed=True) == pytest.approx(-6000, abs=1)
        with pytest.raises(TMCLReplyStatusError) as caught:
            host.get_axis_parameter(77, 0)
        assert caught.value.status_code == 3


@pytest.mark.filterwarnings("ignore:.*ttyBaudrate:DeprecationWarning")
def test_the_class_of_the_nearest_module_moves_and_homes_three_axes_over_slcan(serve, wait_for):
    """PyTrinamic's TMCM3110 on a bench with switches on all three axes."""
    path = serve("--slcan", "--bench", BENCHES / "pick-and-place.toml", "--speed", 20).links[0][1]
    with ConnectionManager(f"--interface slcan_tmcl --port {path}").connect() as host:
        module = TMCM3110(host)
        for axis in range(3):
            host.reference_search(0, axis)
        assert wait_for(lambda: not any(host.reference_search(2, axis) for axis in range(3)))
        for axis, motor in enumerate(module.motors):
            assert motor.actual_position == pytest.approx(0, abs=1)
            module.move_to(axis, 3000 * (axis + 1))
        assert wait_for(lambda: all(motor.get_position_reached() for motor in module.motors))
        assert module.motors[2].actual_position == pytest.approx(9000, abs=1)


def ask(port, frame):
    port.write(frame + b"\r")
    return port.read_until(b"\r"), port.read_until(b"\r")


def test_the_bytes_of_slcan(serve):
    """GAP 4, 0 with seven data bytes, answered with seven."""
    served = serve("--slcan", "--log-telegrams", "-")
    with serial.Serial(served.links[0][1], timeout=PATIENCE_S) as port:
        port.write(b"S8\rO\r")
        assert port.read(2) == b"\r\r"
        assert sorted(ask(port, b"t001706040000000000")) == [b"t00270164060000" + b"03E8\r", b"z\r"]
    log = served.stop()
    assert "slcan 001                >  06 04 00 00 00 00 00        GAP 4, 0" in log
    assert "slcan 002                <  01 64 06 00 00 03 e8        from 1: 100 successfully executed" in log


def test_another_bit_rate_is_silence(serve):
    with serial.Serial(serve("--slcan").links[0][1], timeout=PATIENCE_S) as port:
        port.write(b"S5\rO\rt001706040000000000\r")
        assert port.read(4) == b"\r\rz\r"
        port.timeout = 0.1
        assert port.read(1) == b""


def test_clients_of_one_bus_hear_each_other(serve):
    served = serve("--slcan", "--slcan")
    (_, first), (_, second) = served.links
    with serial.Serial(first, timeout=PATIENCE_S) as one, serial.Serial(second, timeout=PATIENCE_S) as other:
        for port in (one, other):
            port.write(b"S8\rO\r")
            assert port.read(2) == b"\r\r"
        one.write(b"t001706040000000000\r")
        assert other.read_until(b"\r") == b"t001706040000000000\r"
        assert other.read_until(b"\r") == b"t0027016406000003E8\r"


def test_a_bus_of_python_can():
    """Its virtual bus lives in one process: server and client share ours."""

    async def scenario():
        server = Server(simple_rig())
        assert (
            await server.open_can(CanBusLink("virtual", "tmcm34x-test", 1_000_000)) == "virtual:tmcm34x-test"
        )
        with can.Bus(interface="virtual", channel="tmcm34x-test") as client:
            client.send(
                can.Message(arbitration_id=1, data=bytes((6, 4, 0, 0, 0, 0, 0)), is_extended_id=False)
            )
            request = can.Message(arbitration_id=1, data=bytes((6, 4, 0, 0, 0, 0, 0)), is_extended_id=True)
            client.send(request)
            for _ in range(2):
                reply = await asyncio.to_thread(client.recv, PATIENCE_S)
                assert (reply.arbitration_id, reply.is_extended_id) == (2, False)
                assert bytes(reply.data) == bytes((1, 100, 6, 0, 0, 3, 232))
            assert await asyncio.to_thread(client.recv, 0.05) is None
        await server.close()

    asyncio.run(scenario())


@pytest.mark.parametrize(
    ("interface", "channel"), [("nonsense", "x"), ("socketcan", "no-such-bus"), ("slcan", "/dev/none")]
)
def test_a_bus_that_is_not_there_is_refused_in_one_line(interface, channel):
    async def scenario():
        with pytest.raises(LinkOpenError, match=f"cannot join {interface}:{channel}") as caught:
            await CanBusLink(interface, channel, 1_000_000).open(lambda name, send: None)
        assert "\n" not in str(caught.value)

    asyncio.run(scenario())
