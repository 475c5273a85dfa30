"""Faults of lines: by name, repeatable, the same over memory, TCP and pseudo terminals."""

import asyncio
import os
import socket

import pytest

from conftest import PATIENCE_S
from links.descriptors import reads
from tmcm34x import clock
from tmcm34x.bench import simple_rig
from tmcm34x.links.faults import KINDS, FaultError, fault, parse
from tmcm34x.links.faulty import Faults
from tmcm34x.links.memory import MemoryClient
from tmcm34x.links.posix.pty import PtyLink
from tmcm34x.links.tcp import TcpLink
from tmcm34x.links.timing import VirtualTiming
from tmcm34x.server import Server
from tmcm34x.tmcl.datagram import Instruction, checksum, pack_request, unpack_reply

SPEED = Instruction(6, 4, 0)
SET_SPEED = Instruction(5, 4, 0, 1234)


class Bench:
    """A module on a line in memory, with faults, in virtual time."""

    def __init__(self, *faults, seed=0, model=343):
        self.rig = simple_rig(model)
        self.timing = VirtualTiming()
        self.faults = Faults(self.timing, seed)
        self.server = Server(self.rig, monotonic=self.timing.time)
        self.client = MemoryClient(self.faults.wrap(self.server.connect))
        self.faults.cuts(self.client)
        for each in faults:
            self.faults.add(each)

    def ask(self, instruction=SPEED, address=1):
        self.client.write(pack_request(address, instruction))
        return self.client.read()

    def run(self, seconds):
        clock.run_until(self.timing, self.timing.now + clock.clocks(seconds))


def plain():
    return Bench().ask()


def test_without_faults_a_line_is_as_it_was():
    assert unpack_reply(Bench().ask()).status == 100


def test_silent_the_request_does_not_reach_the_module():
    bench = Bench("silent,count=1")
    assert bench.ask(SET_SPEED) == b""
    assert unpack_reply(bench.ask()).value != 1234


def test_drop_the_command_is_executed_and_its_reply_is_lost():
    bench = Bench("drop,count=1")
    assert bench.ask(SET_SPEED) == b""
    assert unpack_reply(bench.ask()).value == 1234


@pytest.mark.parametrize("count", [1, 4, 8])
def test_drop_may_lose_some_bytes_only(count):
    reply = Bench(f"drop={count}").ask()
    assert len(reply) == 9 - count


def test_bad_checksum_changes_the_last_byte_alone():
    reply = Bench("bad_checksum").ask()
    assert reply[:-1] == plain()[:-1]
    assert checksum(reply[:-1]) != reply[-1]


@pytest.mark.parametrize("count", [1, 3])
def test_garble_changes_some_bytes(count):
    reply = Bench(f"garble={count}").ask()
    assert sum(a != b for a, b in zip(reply, plain(), strict=True)) == count


def test_duplicate_sends_the_reply_twice():
    assert Bench("duplicate").ask() == 2 * plain()


def test_stray_bytes_come_before_the_reply():
    reply = Bench("stray=3").ask()
    assert (len(reply), reply[3:]) == (12, plain())


def test_wrong_address_has_the_right_sum():
    reply = unpack_reply(Bench("wrong_address").ask())
    assert (reply.address != 1, reply.status) == (True, 100)


def test_delay_and_split_take_their_time():
    bench = Bench("delay=100", "split=30")
    assert bench.ask() == b""
    bench.run(0.0999)
    assert bench.client.read() == b""
    bench.run(0.0002)
    first = bench.client.read()
    assert 0 < len(first) < 9
    bench.run(0.0301)
    assert first + bench.client.read() == plain()


def test_a_reply_does_not_overtake_a_delayed_one():
    bench = Bench("delay=100,count=1")
    assert bench.ask(Instruction(6, 5, 0)) + bench.ask() == b""
    bench.run(0.2)
    replies = bench.client.read()
    assert [unpack_reply(replies[n : n + 9]).value for n in (0, 9)] == [
        unpack_reply(Bench().ask(Instruction(6, 5, 0))).value,
        unpack_reply(plain()).value,
    ]


def test_a_late_reply_comes_with_the_next_request():
    bench = Bench("late_reply,count=1")
    assert bench.ask(SET_SPEED) == b""
    replies = bench.ask()
    assert [unpack_reply(replies[n : n + 9]).command for n in (0, 9)] == [5, 6]


@pytest.mark.parametrize("status", [1, 2, 3, 4, 5, 6, 128])
def test_status_refuses_without_executing(status):
    bench = Bench(f"status={status},count=1")
    reply = unpack_reply(bench.ask(SET_SPEED))
    assert (reply.host, reply.address, reply.status) == (2, 1, status)
    assert (reply.command, reply.value) == ((0, 0) if status == 1 else (5, 1234))
    assert unpack_reply(bench.ask()).value != 1234


def test_status_in_a_download_stores_nothing():
    bench = Bench()
    assert unpack_reply(bench.ask(Instruction(132))).status == 100
    bench.faults.add("status=6,count=1")
    assert unpack_reply(bench.ask(SET_SPEED)).status == 6
    assert unpack_reply(bench.ask(SET_SPEED)).status == 101
    bench.ask(Instruction(133))
    assert bench.rig.modules[0].eeprom.read_instruction(0) == SET_SPEED
    assert bench.rig.modules[0].eeprom.read_instruction(1) == Instruction(0)


def test_status_with_a_telegram_pause():
    bench = Bench()
    bench.ask(Instruction(9, 75, 0, 10))
    bench.run(0.1)
    bench.server.catch_up()
    bench.client.read()
    bench.faults.add("status=4,count=1")
    assert bench.ask(SET_SPEED) == b""
    bench.run(0.011)
    bench.server.catch_up()
    reply = unpack_reply(bench.client.read())
    assert (reply.status, reply.command, reply.value) == (4, 5, 1234)


def test_a_request_for_another_module_is_not_answered_with_a_status():
    assert Bench("status=4").ask(address=7) == b""


def test_disconnect_cuts_the_line_in_place_of_a_reply_and_it_may_be_connected_again():
    bench = Bench("disconnect,after=1")
    assert bench.ask()
    assert bench.ask(SET_SPEED) == b""
    assert not bench.client.connected
    assert not bench.rig.modules[0].ports
    assert bench.ask() == b""
    bench.client.plug_in()
    assert unpack_reply(bench.ask()).value == 1234


def test_unplug_lasts_for_its_time():
    bench = Bench("unplug,for=2")
    bench.ask()
    bench.run(1.9)
    assert not bench.client.connected
    bench.run(0.2)
    assert bench.ask() == plain()


def test_a_duration_ends_a_fault():
    bench = Bench("silent,for=1")
    assert bench.ask() == b""
    bench.run(0.9)
    assert bench.ask() == b""
    bench.run(0.2)
    assert bench.ask() == plain()
    assert not bench.faults.armed
    assert bench.faults.struck == {"silent": 2}


def test_after_lets_some_pass():
    bench = Bench("drop,after=2,count=1")
    assert [bool(bench.ask()) for _ in range(4)] == [True, True, False, True]


def test_faults_can_be_ended_by_name():
    bench = Bench("silent", "garble")
    bench.faults.clear("silent")
    assert bench.ask() not in {b"", plain()}
    bench.faults.clear()
    assert bench.ask() == plain()


def test_several_telegrams_at_once_are_struck_one_by_one():
    bench = Bench("silent,count=1")
    bench.client.write(2 * pack_request(1, SPEED))
    assert bench.client.read() == plain()


def test_the_same_seed_gives_the_same_faults():
    spec = [f"{kind.name}{'=4' if kind.unit == 'N' else ''},probability=0.2" for kind in KINDS[:11]]

    def replies(seed):
        bench = Bench(*spec, seed=seed)
        heard = []
        for _ in range(200):
            heard.append(bench.ask())
            bench.run(0.01)
            heard.append(bench.client.read())
        assert set(bench.faults.struck) == {kind.name for kind in KINDS[:11]}
        return heard

    assert replies(1) == replies(1)
    assert replies(1) != replies(2)


def test_a_fault_less_changes_nothing_about_the_random_numbers_of_another():
    def garbled(*others):
        bench = Bench("garble,probability=0.5", *others)
        return [bench.ask() for _ in range(50)]

    assert garbled() == garbled("silent,after=1000,probability=0.5")


@pytest.mark.parametrize("kind", KINDS, ids=lambda kind: kind.name)
def test_the_text_of_a_fault_is_read_back(kind):
    value = 7 if kind.unit == "N" else None
    for made in (
        fault(kind.name, value),
        fault(kind.name, value, count=3, probability=0.25, duration_s=1.5, after=2),
    ):
        assert parse(str(made)) == made


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("", "there is no fault ''"),
        ("garbel", "there is no fault 'garbel'; there are silent"),
        ("silent=3", "silent takes no value"),
        ("status", "status needs a value: status=N"),
        ("status=256", "N must be 0..255, not 256"),
        ("delay=x", "'delay=x' needs a number"),
        ("delay=nan", "'delay=nan' is out of range"),
        ("drop,count=0", "count must be 1 or more"),
        ("drop,count=1.5", "count must be a whole number, not 1.5"),
        ("drop,probability=0", "probability must be more than 0"),
        ("drop,probability=1.1", "at most 1"),
        ("drop,for=-1", "for must be a number of seconds"),
        ("drop,times=2", "'times=2' is none of count="),
    ],
)
def test_what_is_no_fault_is_refused_in_one_line(text, reason):
    with pytest.raises(FaultError) as caught:
        parse(text)
    assert reason in str(caught.value)
    assert "\n" not in str(caught.value)


# On links


async def ask(loop, client, size=9):
    await loop.sock_sendall(client, pack_request(1, SPEED))
    data = b""
    while len(data) < size and (chunk := await asyncio.wait_for(loop.sock_recv(client, size), PATIENCE_S)):
        data += chunk
    return data


def hung_up(fd):
    """Whether the line is gone for good; it is told by an error or by an end."""
    try:
        return os.read(fd, 1) == b""
    except BlockingIOError:
        return False
    except OSError:
        return True


async def gone(loop, client):
    """Whether the connection has been closed in place of a reply."""
    try:
        return await ask(loop, client) == b""
    except ConnectionError:
        return True


def connect(address):
    host, port = address.rsplit(":", 1)
    client = socket.create_connection((host, int(port)))
    client.setblocking(False)
    return client


def test_over_tcp():
    async def scenario():
        loop = asyncio.get_running_loop()
        faults = Faults()
        server = Server(simple_rig(), faults=faults)
        address = await server.open(TcpLink("127.0.0.1", 0))
        with connect(address) as client:
            faults.add("duplicate,count=1")
            faults.add("delay=5,count=1")
            assert await ask(loop, client, 18) == 2 * plain()
            faults.add("disconnect")
            assert await gone(loop, client)
        with connect(address) as client:
            assert await ask(loop, client) == plain()
            faults.add("unplug")
            assert await gone(loop, client)
        with connect(address) as client:
            assert await gone(loop, client)
        await server.close()

    asyncio.run(scenario())


def test_on_a_pseudo_terminal(tmp_path):
    link = tmp_path / "module"

    async def scenario():
        faults = Faults()
        server = Server(simple_rig(), faults=faults)
        await server.open(PtyLink(str(link)))
        client = os.open(link, os.O_RDWR | os.O_NOCTTY | os.O_NONBLOCK)
        faults.add("stray=2,count=1")
        os.write(client, pack_request(1, SPEED))
        assert (await reads(client, 11))[2:] == plain()
        faults.add("unplug,for=0.05")
        os.write(client, pack_request(1, SPEED))
        while not hung_up(client):
            await asyncio.sleep(0.001)
        os.close(client)
        while not link.exists():
            await asyncio.sleep(0.001)
        client = os.open(link, os.O_RDWR | os.O_NOCTTY | os.O_NONBLOCK)
        os.write(client, pack_request(1, SPEED))
        assert await reads(client, 9) == plain()
        os.close(client)
        await server.close()

    asyncio.run(scenario())
