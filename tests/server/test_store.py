"""What was acknowledged is kept: a server that is killed, a disk that is full, a memory at rest."""

import asyncio
import os
import random
import socket
import subprocess
import sys
import threading
import time
from pathlib import Path

import pytest

from tmcm34x.firmware.changes import ENTRY_SIZE
from tmcm34x.firmware.storage import Eeprom
from tmcm34x.server import EepromFile, Store, store
from tmcm34x.server.eeprom_file import EepromFileError
from tmcm34x.tmcl.datagram import SIZE, Instruction, pack_request, unpack_reply

KILLS = int(os.environ.get("SOAK_KILLS", "20"))


def read(path):
    return Eeprom.from_bytes(path.read_bytes())


class Killable:
    """A server in a process of its own, and a host of it."""

    def __init__(self, breeder, path):
        self.breeder = breeder
        host, port = breeder.ask(f"serve {path}").rsplit(":", 1)
        self.socket = socket.create_connection((host, int(port)), timeout=60)

    def send(self, *instructions):
        self.socket.sendall(b"".join(pack_request(1, instruction) for instruction in instructions))

    def replies(self, size):
        data = b""
        while len(data) < size and (chunk := self.socket.recv(size - len(data))):
            data += chunk
        return [unpack_reply(data[n : n + SIZE]) for n in range(0, len(data) - SIZE + 1, SIZE)]

    def kill(self):
        assert self.breeder.ask("kill") == "killed"
        self.socket.close()


class Breeder:
    """A process that has everything imported and starts servers by forking, which takes milliseconds."""

    def __init__(self):
        script = Path(__file__).with_name("breeder.py")
        self.process = subprocess.Popen(
            [sys.executable, script], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
        )

    def ask(self, line):
        print(line, file=self.process.stdin, flush=True)
        return self.process.stdout.readline().strip()

    def close(self):
        self.process.stdin.close()
        assert self.process.wait(10) == 0
        self.process.stdout.close()


@pytest.fixture
def breeder():
    breeder = Breeder()
    yield breeder
    breeder.close()


def stores(value):
    """Telegrams that store something, each with what it does to a memory."""
    speed, position = value % 2048, value % 1000
    return [
        [(Instruction(9, 68, 0, value), lambda e: e.set_global_value(68, value))],
        [
            (Instruction(5, 4, 1, speed), None),
            (Instruction(7, 4, 1), lambda e: e.set_axis_value(1, 4, speed)),
        ],
        [
            (Instruction(9, 3, 2, -value), None),
            (Instruction(11, 3, 2), lambda e: e.set_variable(3, -value)),
        ],
        [
            (Instruction(9, 84, 0, 1), lambda e: e.set_global_value(84, 1)),
            (Instruction(30, 5, 2, position), lambda e: e.set_coordinate(5, 2, position)),
        ],
        [
            (Instruction(132, 0, 0, position), None),
            (
                Instruction(1, 0, 0, value),
                lambda e: e.write_instruction(position, Instruction(1, 0, 0, value)),
            ),
            (Instruction(133), None),
        ],
    ]


def test_a_killed_server_has_lost_nothing_that_it_acknowledged(tmp_path, breeder):
    """Stores of all kinds; the server dies after some of their replies, with others on their way."""
    path, draw = tmp_path / "memory", random.Random(34)
    expected = Eeprom(343)
    for kill in range(KILLS):
        server = Killable(breeder, path)
        groups = stores(kill + 1)
        draw.shuffle(groups)
        steps = [step for group in groups for step in group]
        acknowledged = draw.randint(0, len(steps))
        server.send(*(telegram for telegram, _ in steps))
        replies = server.replies(SIZE * acknowledged)
        assert all(reply.status in {100, 101} for reply in replies)
        server.kill()
        possible = []
        for done, (_, change) in enumerate(steps, 1):
            if done > acknowledged:
                possible.append(expected.to_bytes())
            if change is not None:
                change(expected)
        possible.append(expected.to_bytes())
        expected = read(path)
        assert expected.to_bytes() in possible


def test_factory_settings_are_kept_though_nothing_acknowledges_them(tmp_path, breeder):
    path = tmp_path / "memory"
    server = Killable(breeder, path)
    server.send(Instruction(9, 68, 0, 99))
    assert [reply.value for reply in server.replies(SIZE)] == [99]
    server.send(Instruction(137, 0, 0, 1234))  # which has no reply and forgets what comes with it
    while read(path).global_values[68]:
        time.sleep(0.001)
    server.kill()
    assert read(path).to_bytes() == Eeprom(343).to_bytes()


class Kept:
    """A memory with its store on a running event loop."""

    def __init__(self, path, monkeypatch, **options):
        monkeypatch.setattr(store, "REST_S", 0.02)
        monkeypatch.setattr(store, "RETRY_S", 0.02)
        self.lines = []
        self.path = path
        self.file = EepromFile(path)
        self.eeprom = Eeprom(343)
        self.store = Store(self.eeprom, self.file, self.lines.append, **options)
        self.store.begin()
        self.size = path.stat().st_size
        self.store.start()

    async def until(self, condition):
        for _ in range(60_000):
            if condition():
                return True
            await asyncio.sleep(0.001)
        return False

    @property
    def journal(self):
        """Entries behind the image in the file."""
        return (self.path.stat().st_size - self.size) // ENTRY_SIZE


def test_at_rest_the_journal_becomes_an_image(tmp_path, monkeypatch):
    async def scenario():
        kept = Kept(tmp_path / "memory", monkeypatch)
        kept.eeprom.set_variable(3, 4)
        kept.eeprom.set_variable(3, 5)
        assert kept.journal == 2
        assert await kept.until(lambda: kept.journal == 0)
        assert read(kept.path).variables[3] == 5
        before = kept.path.stat()
        assert await kept.until(lambda: kept.store._task is None)
        assert kept.store._timer is None  # nothing will happen any more
        assert kept.path.stat() == before
        await kept.store.close()
        assert list(tmp_path.iterdir()) == [kept.path]

    asyncio.run(scenario())


def test_a_long_journal_becomes_an_image_without_a_rest(tmp_path, monkeypatch):
    async def scenario():
        monkeypatch.setattr(store, "LONGEST_JOURNAL", 10)
        kept = Kept(tmp_path / "memory", monkeypatch)
        monkeypatch.setattr(store, "REST_S", 1.0)  # which a busy machine lets nothing rest for
        inode, value = kept.path.stat().st_ino, 0
        while kept.path.stat().st_ino == inode and value < 5000:
            value += 1
            kept.eeprom.set_variable(3, value)
            await asyncio.sleep(0.001)
        assert 10 <= value < 5000
        assert read(kept.path).variables[3] == value
        await kept.store.close()

    asyncio.run(scenario())


def test_what_changes_while_an_image_is_written_is_in_the_file_before_and_after(tmp_path, monkeypatch):
    async def scenario():
        kept = Kept(tmp_path / "memory", monkeypatch)
        prepare = kept.file.prepare

        def prepare_slowly(image):
            new = prepare(image)
            loop.call_soon_threadsafe(change)
            assert done.wait(10)
            return new

        def change():
            kept.eeprom.set_variable(3, 7)
            assert read(kept.path).variables[3] == 7
            done.set()

        loop, done = asyncio.get_running_loop(), threading.Event()
        kept.file.prepare = prepare_slowly
        kept.eeprom.set_variable(2, 6)
        assert await kept.until(lambda: done.is_set() and kept.journal == 1)
        assert read(kept.path).variables[2:4] == [6, 7]
        kept.file.prepare = prepare
        assert await kept.until(lambda: kept.journal == 0)
        kept.eeprom.set_variable(1, 5)
        assert read(kept.path).variables[1:4] == [5, 6, 7]
        await kept.store.close()
        assert read(kept.path).variables[1:4] == [5, 6, 7]

    asyncio.run(scenario())


class FullDisk:
    """A disk that takes nothing while `full`."""

    def __init__(self, file):
        self.full = True
        for name in ("append", "prepare"):
            setattr(file, name, self.refusing(getattr(file, name)))

    def refusing(self, action):
        def act(*operands):
            if self.full:
                raise EepromFileError("memory: No space left on device")
            return action(*operands)

        return act


def test_a_full_disk_is_tried_again_until_there_is_room(tmp_path, monkeypatch):
    async def scenario():
        kept = Kept(tmp_path / "memory", monkeypatch)
        disk = FullDisk(kept.file)
        kept.eeprom.set_variable(3, 4)
        kept.eeprom.set_variable(4, 5)
        assert kept.store.error == "memory: No space left on device"
        await asyncio.sleep(0.1)  # many tries that must not be reported again
        assert kept.lines == ["memory not saved: memory: No space left on device; trying again every second"]
        disk.full = False
        assert await kept.until(lambda: not kept.store.error)
        assert kept.lines[1:] == ["memory saved"]
        assert read(kept.path).variables[3:5] == [4, 5]
        kept.eeprom.set_variable(3, 6)
        assert read(kept.path).variables[3] == 6
        await kept.store.close()

    asyncio.run(scenario())


def test_a_disk_that_stays_full_is_known_at_the_end(tmp_path, monkeypatch):
    async def scenario():
        kept = Kept(tmp_path / "memory", monkeypatch)
        disk = FullDisk(kept.file)
        kept.eeprom.set_variable(3, 4)
        await kept.store.close()
        assert kept.store.error
        assert disk.full
        assert read(kept.path).variables[3] == 0

    asyncio.run(scenario())


def test_a_full_disk_for_the_image_alone_loses_nothing(tmp_path, monkeypatch):
    async def scenario():
        kept = Kept(tmp_path / "memory", monkeypatch)
        kept.eeprom.set_variable(3, 4)
        FullDisk(kept.file)
        await kept.store.close()
        assert not kept.store.error
        assert read(kept.path).variables[3] == 4

    asyncio.run(scenario())


@pytest.mark.parametrize("durable", [False, True])
def test_a_durable_store_is_on_the_disk_before_the_reply(tmp_path, monkeypatch, durable):
    async def scenario():
        kept = Kept(tmp_path / "memory", monkeypatch, durable=durable)
        synchronised = []
        monkeypatch.setattr(os, "fsync", synchronised.append)
        kept.eeprom.set_variable(3, 4)
        assert len(synchronised) == durable
        await kept.store.close()

    asyncio.run(scenario())
