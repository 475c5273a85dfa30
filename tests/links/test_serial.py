"""A serial port, played by a pseudo terminal."""

import asyncio
import os
import tty

import pytest

from links.descriptors import reads
from tmcm34x.links import LinkOpenError
from tmcm34x.links.serial import SerialLink


class Echo:
    """A peer that answers with what it gets."""

    def __init__(self):
        self.hang_ups = 0

    def connect(self, name, send):
        self.receive = send
        return self

    def disconnect(self):
        self.hang_ups += 1


@pytest.fixture
def cable():
    """Two ends: our descriptor, and the path of the port at the other."""
    ours, theirs = os.openpty()
    tty.setraw(theirs)
    os.set_blocking(ours, False)
    yield ours, os.ttyname(theirs)
    os.close(ours)
    os.close(theirs)


def test_bytes_go_both_ways(cable):
    ours, path = cable

    async def scenario():
        link, echo = SerialLink(path, 9600), Echo()
        assert await link.open(echo.connect) == path
        os.write(ours, b"\x00\xff\r\n")
        assert await reads(ours, 4) == b"\x00\xff\r\n"
        link.close()
        assert echo.hang_ups == 1

    asyncio.run(scenario())


def test_a_port_that_is_used_already_is_refused(cable):
    _, path = cable

    async def scenario():
        link = SerialLink(path, 9600)
        await link.open(Echo().connect)
        with pytest.raises(LinkOpenError, match=f"cannot open {path}"):
            await SerialLink(path, 9600).open(Echo().connect)
        link.close()

    asyncio.run(scenario())


@pytest.mark.parametrize("device", ["/dev/no-such-port", "/dev/null"])
def test_what_is_no_port_is_refused_in_one_line(device):
    async def scenario():
        with pytest.raises(LinkOpenError, match=f"cannot open {device}") as caught:
            await SerialLink(device, 9600).open(Echo().connect)
        assert "\n" not in str(caught.value)

    asyncio.run(scenario())


def test_a_port_that_goes_away_and_comes_back_is_reported_once_each(tmp_path, monkeypatch):
    """An adapter pulled and plugged in again, played by two pseudo terminals under one name."""
    monkeypatch.setattr("tmcm34x.links.serial.RETRY_S", 0.01)
    path = tmp_path / "adapter"

    def plug_in():
        ours, theirs = os.openpty()
        tty.setraw(theirs)
        os.set_blocking(ours, False)
        path.symlink_to(os.ttyname(theirs))
        return ours, theirs

    async def until(condition):
        for _ in range(60_000):
            if condition():
                return True
            await asyncio.sleep(0.001)
        return False

    async def scenario():
        ours, theirs = plug_in()
        link, echo, lines = SerialLink(str(path), 9600), Echo(), []
        link.report = lines.append
        await link.open(echo.connect)
        path.unlink()
        os.close(theirs)
        os.close(ours)
        assert await until(lambda: lines)
        assert echo.hang_ups == 1
        assert await until(lambda: link._retry is not None)
        ours, theirs = plug_in()
        assert await until(lambda: len(lines) == 2)
        os.write(ours, b"again")
        assert await reads(ours, 5) == b"again"
        link.close()
        os.close(ours)
        os.close(theirs)
        gone = f"{path} was disconnected (No such file or directory); trying again every second"
        assert lines == [gone, f"{path} is back"]

    asyncio.run(scenario())
