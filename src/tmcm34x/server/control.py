"""Control of a bench at work: lines of JSON on a local socket (docs/control.md).

Each line is a request, an object with `do`; each gets one line back, with `ok` or with `error`.  A line that is no
such object ends the connection, so that no other protocol (a page in a browser, say) can reach the bench by accident.
"""

from __future__ import annotations

import asyncio
import base64
import binascii
import contextlib
import json
import os
import stat
import sys
from collections.abc import Awaitable, Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, cast

from tmcm34x import clock
from tmcm34x.bench.action import Action, ActionError, Value
from tmcm34x.bench.snapshot import SnapshotError
from tmcm34x.links import LinkOpenError
from tmcm34x.links.faults import FaultError, parse
from tmcm34x.links.faulty import Faults
from tmcm34x.links.tcp import keep_alive
from tmcm34x.server.pace import MOST_SPEED

if TYPE_CHECKING:
    from tmcm34x.bench.counters import Counters
    from tmcm34x.server.server import Server

LONGEST_LINE: Final = 1 << 20
PATIENCE_S: Final = 10.0
"""A client that does not take its reply in this time is disconnected."""
MOST_SECONDS: Final = 1e6

_PLAIN: Final = {int, float, str, bool, type(None)}

Request = dict[str, Any]
ControlReply = dict[str, Any]


class ControlError(ValueError):
    """A request that cannot be done; one line."""


class Control:
    """The control socket of `server`.

    address: `[HOST:]PORT`, or the path of a socket in the file system
    refuse: says why a request of this name cannot be done now; empty where it can
    """

    def __init__(
        self, server: Server, address: str, counters: Counters, refuse: Callable[[str], str] = lambda _: ""
    ) -> None:
        self._server = server
        self._address = address
        self._counters = counters
        self._refuse = refuse
        self._socket: asyncio.Server | None = None
        self._clients: set[asyncio.Task[None]] = set()
        self._path: Path | None = None

    async def open(self) -> str:
        """Listen; returns the address in use.  Raises `LinkOpenError`."""
        host, _, port = self._address.rpartition(":")
        try:
            if port.isdecimal() and "/" not in self._address:
                return await self._listen(host.strip("[]") or "127.0.0.1", int(port))
            return await self._listen_at(Path(self._address))
        except (OSError, OverflowError) as error:
            reason = getattr(error, "strerror", None) or str(error)
            raise LinkOpenError(f"cannot listen on {self._address}: {reason}") from error

    async def close(self) -> None:
        """Hang up."""
        if self._socket is not None:
            self._socket.close()
        for client in tuple(self._clients):
            client.cancel()
        await asyncio.gather(*self._clients, return_exceptions=True)
        if self._path is not None:
            self._path.unlink(missing_ok=True)

    async def _listen(self, host: str, port: int) -> str:
        self._socket = await asyncio.start_server(self._connected, host, port, limit=LONGEST_LINE)
        host, port = self._socket.sockets[0].getsockname()[:2]
        return f"[{host}]:{port}" if ":" in host else f"{host}:{port}"

    async def _listen_at(self, path: Path) -> str:
        if sys.platform == "win32":
            raise OSError(0, "there are no sockets in the file system here; use [HOST:]PORT")
        with contextlib.suppress(FileNotFoundError):
            if stat.S_ISSOCK(path.lstat().st_mode) and not await _answers(path):
                path.unlink()  # of a process that was killed
        if os.path.lexists(path):  # a link that leads nowhere is in the way too
            raise OSError(0, "there is a file of this name already")
        mask = os.umask(0o177)
        try:
            self._socket = await asyncio.start_unix_server(self._connected, path, limit=LONGEST_LINE)
        finally:
            os.umask(mask)
        self._path = path
        return str(path)

    async def _connected(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        task = asyncio.current_task()
        assert task is not None
        self._clients.add(task)
        if self._path is None:
            keep_alive(writer.get_extra_info("socket"))
        try:
            await self._converse(reader, writer)
        except (OSError, TimeoutError, asyncio.CancelledError):
            pass  # the client has gone, or the server ends
        finally:
            self._clients.discard(task)
            writer.close()

    async def _converse(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        while True:
            try:
                line = await reader.readline()
            except ValueError:
                await _send(writer, {"error": f"a line has at most {LONGEST_LINE} bytes"})
                return
            if not line.endswith(b"\n"):
                return
            request = _read(line)
            if request is None:
                await _send(writer, {"error": 'expected a line with a JSON object that has "do"'})
                return
            await _send(writer, await self._answer(request))

    async def _answer(self, request: Request) -> ControlReply:
        known = {"id": request["id"]} if "id" in request else {}
        try:
            row = _REQUESTS.get(str(request["do"]))
            if row is None:
                raise ControlError(f"there is no request {request['do']!r}; there are {', '.join(_REQUESTS)}")
            if why := self._refuse(str(request["do"])):
                raise ControlError(why)
            return {**known, "ok": True, **await row(self, request)}
        except (ControlError, ActionError, FaultError, SnapshotError) as error:
            return {**known, "error": str(error)}

    # Requests; the methods of the table below

    async def do_act(self, request: Request) -> ControlReply:
        """Do something to the bench: `action`, `module`, `operands`."""
        name, module = str(request.get("action")), _whole(request, "module", 0)
        action = Action(name, module, _plain(request.get("operands", [])))
        self._server.catch_up()
        try:
            self._server.rig.act(action)
        finally:
            self._server.settle()
        return {}

    async def do_fault(self, request: Request) -> ControlReply:
        """Put a fault of the lines in force: `fault`; a cut without `after` happens at once."""
        fault, faults = parse(str(request.get("fault"))), self._faults()
        if fault.kind.strikes == "line" and not fault.after and fault.probability == 1:
            faults.cut(fault)
        else:
            faults.add(fault)
        return {}

    async def do_clear(self, request: Request) -> ControlReply:
        """End the faults of one kind, `fault`, or all."""
        name = request.get("fault")
        self._faults().clear(None if name is None else str(name))
        return {}

    def _faults(self) -> Faults:
        assert self._server.faults is not None
        return self._server.faults

    async def do_speed(self, request: Request) -> ControlReply:
        """Change the speed of virtual time: `speed`."""
        self._server.change_pace(speed=_number(request, "speed", 0.0, MOST_SPEED))
        return {}

    async def do_pause(self, _: Request) -> ControlReply:
        """Stop virtual time."""
        self._server.change_pace(paused=True)
        return {}

    async def do_resume(self, _: Request) -> ControlReply:
        """Let virtual time go on."""
        self._server.change_pace(paused=False)
        return {}

    async def do_until(self, request: Request) -> ControlReply:
        """Let `seconds` of virtual time pass as fast as possible; answered when they are over."""
        seconds = _number(request, "seconds", 0.0, MOST_SECONDS)
        await self._server.run_until(self._server.rig.now + clock.clocks(seconds))
        return {"now": clock.seconds(self._server.rig.now)}

    async def do_snapshot(self, _: Request) -> ControlReply:
        """Give the state of the bench, in base64."""
        self._server.catch_up()
        try:
            return {"snapshot": base64.b64encode(self._server.rig.snapshot()).decode()}
        finally:
            self._server.settle()

    async def do_restore(self, request: Request) -> ControlReply:
        """Go back to a `snapshot`."""
        try:
            data = base64.b64decode(str(request.get("snapshot")), validate=True)
        except binascii.Error:
            raise ControlError("snapshot must be base64") from None
        self._server.restore(data)
        return {"now": clock.seconds(self._server.rig.now)}

    async def do_digest(self, _: Request) -> ControlReply:
        """Give the fingerprint of the state."""
        self._server.catch_up()
        try:
            return {"digest": self._server.rig.digest(), "now": clock.seconds(self._server.rig.now)}
        finally:
            self._server.settle()

    async def do_state(self, _: Request) -> ControlReply:
        """Give what can be seen of the modules."""
        server = self._server
        server.catch_up()
        modules = [
            {
                "powered": world.module.powered,
                "program": world.module.program.state,
                "outputs": world.module.board.outputs,
                "motors": [_motor(mount.view()) for mount in world.mounts],
            }
            for world in server.rig.worlds
        ]
        server.settle()
        pace = server.pace
        now = clock.seconds(server.rig.now)
        return {"now": now, "speed": pace.speed, "paused": pace.paused, "modules": modules}

    async def do_counters(self, _: Request) -> ControlReply:
        """Give what has been counted."""
        faults = self._server.faults
        return {"modules": self._counters.figures(), "faults": {} if faults is None else dict(faults.struck)}


MOVE_TIME: Final = frozenset({"speed", "pause", "resume", "until", "restore"})
"""Requests that change how time passes, or where it stands."""
_REQUESTS: Final[dict[str, Callable[[Control, Request], Awaitable[ControlReply]]]] = {
    "act": Control.do_act,
    "fault": Control.do_fault,
    "clear": Control.do_clear,
    "speed": Control.do_speed,
    "pause": Control.do_pause,
    "resume": Control.do_resume,
    "until": Control.do_until,
    "snapshot": Control.do_snapshot,
    "restore": Control.do_restore,
    "digest": Control.do_digest,
    "state": Control.do_state,
    "counters": Control.do_counters,
}


def _motor(view: Any) -> dict[str, Any]:
    names = ("position", "lost_fullsteps", "load", "current_ma", "speed", "left", "right", "faults")
    return {name: getattr(view, name) for name in names}


def _read(line: bytes) -> Request | None:
    try:
        request = json.loads(line)
    except (ValueError, RecursionError):
        return None
    return request if isinstance(request, dict) and "do" in request else None  # pyright: ignore[reportUnknownVariableType]


async def _send(writer: asyncio.StreamWriter, answer: ControlReply) -> None:
    writer.write(json.dumps(answer).encode() + b"\n")
    await asyncio.wait_for(writer.drain(), PATIENCE_S)


async def _answers(path: Path) -> bool:
    if sys.platform == "win32":
        return False
    try:
        _, writer = await asyncio.open_unix_connection(path)
    except OSError:
        return False
    writer.close()
    return True


def _plain(operands: Any) -> tuple[Value, ...]:
    if type(operands) is not list:
        raise ControlError("operands must be a list")
    values: tuple[Any, ...] = tuple(cast("list[Any]", operands))
    if not all(type(value) in _PLAIN for value in values):
        raise ControlError("operands must be numbers, words, true, false or null")
    return values


def _number(request: Request, name: str, low: float, high: float) -> float:
    value: Any = request.get(name)
    if type(value) not in {int, float} or not low <= value <= high:
        raise ControlError(f"{name} must be a number of {low:g}..{high:g}")
    return float(value)


def _whole(request: Request, name: str, default: int) -> int:
    value = request.get(name, default)
    if type(value) is not int:
        raise ControlError(f"{name} must be a whole number")
    return value
