"""A host's line to modules in this process.

Waiting costs nothing: where the bench is in virtual time, time goes on by itself while the host reads or sleeps.

`host.line` opens a line for URLs such as `virtual:343?bench=stage.toml&seed=1`; there telegrams take their time on the
wire, ten bits a byte at the line's bit rate, so that a host that asks again and again lets time pass as it would at a
machine.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Final, Protocol, TypeVar

from tmcm34x.bench.rig import BenchError, Rig, simple_rig
from tmcm34x.clock import HZ, clocks, run_until, seconds
from tmcm34x.firmware.ports.serial import SerialPort
from tmcm34x.firmware.storage import Eeprom, EepromError
from tmcm34x.host.exceptions import LinkError
from tmcm34x.host.steps import Follow
from tmcm34x.host.url import Url
from tmcm34x.links import Peer, Send
from tmcm34x.links.faulty import Faults
from tmcm34x.links.memory import MemoryClient
from tmcm34x.links.timing import VirtualTiming
from tmcm34x.tmcl.global_parameters import BAUD_RATES

BITS_PER_BYTE: Final = 10
DEFAULT_MODEL: Final = 343
Result = TypeVar("Result")


class Hosted(Protocol):
    """A bench as a host in this process needs it: lines, and time."""

    @property
    def now(self) -> float:
        """The bench's time [s]."""
        ...

    def do(self, work: Callable[[], Result]) -> Result:
        """What `work` returns, called while nothing else works on the bench."""
        ...

    def connect_line(self, name: str, send: Send) -> Peer:
        """One more line: the modules' end of it."""
        ...

    def run(self, seconds: float) -> None:
        """Let time pass."""
        ...

    def run_until(self, holds: Callable[[], Any], timeout: float, *, events_only: bool = False) -> bool:
        """Let `timeout` seconds pass, or less if `holds`; says whether it does."""
        ...


class InProcessLine:
    """A line to a bench; see `host.line.Line`."""

    real = False

    def __init__(self, bench: Hosted, name: str) -> None:
        self.name = name
        self._bench = bench
        self._client = bench.do(lambda: MemoryClient(bench.connect_line, "host"))

    def write(self, data: bytes) -> None:
        """Send `data`."""
        self._bench.do(lambda: self._client.write(data))

    def read(self, size: int, timeout_s: float) -> bytes:
        """At least `size` bytes, or what has come when the time is over."""
        if self._client.waiting < size:
            self._bench.run_until(lambda: self._client.waiting >= size, timeout_s, events_only=True)
        return self._client.read()

    def waiting(self) -> bytes:
        """What has come already."""
        return self._client.read()

    def now(self) -> float:
        """The bench's time [s]."""
        return self._bench.now

    def sleep(self, seconds: float) -> None:
        """Let the bench's time pass."""
        self._bench.run(seconds)

    def follow(self, change: Follow, address: int) -> int:
        """There is no bit rate here; only the address may change."""
        return address if change.address is None else change.address

    def close(self) -> None:
        """Hang up."""
        self._bench.do(self._client.close)


class RigLine(InProcessLine):
    """The serial line of all modules of `rig`, in virtual time.

    baud: bits per second; a module at another one receives nothing
    faults: of the line
    """

    def __init__(
        self, rig: Rig, baud: int = BAUD_RATES[0], name: str = "virtual", faults: Faults | None = None
    ) -> None:
        self.rig = rig
        self.baud = baud
        super().__init__(_HostedRig(self, faults), name)

    def write(self, data: bytes) -> None:
        """Send `data`; it arrives when its last bit has."""
        self.sleep(self._wire_s(data))
        super().write(data)

    def read(self, size: int, timeout_s: float) -> bytes:
        """At least `size` bytes, or what has come within `timeout_s` of virtual time."""
        data = super().read(size, timeout_s)
        self.sleep(self._wire_s(data))
        return data

    def follow(self, change: Follow, address: int) -> int:
        """Change the bit rate, or the address."""
        if change.baud is not None:
            self.baud = change.baud
        return super().follow(change, address)

    def _wire_s(self, data: bytes) -> float:
        return len(data) * BITS_PER_BYTE / self.baud


class _HostedRig:
    """The rig of a line, whose time only that line moves on."""

    def __init__(self, line: RigLine, faults: Faults | None) -> None:
        self._line = line
        self._rig = line.rig
        self._timing = VirtualTiming(line.rig.now)
        self._faults = faults
        if faults is not None:
            faults.timing = self._timing

    @property
    def now(self) -> float:
        return seconds(self._rig.now)

    def do(self, work: Callable[[], Result]) -> Result:
        return work()

    def connect_line(self, name: str, send: Send) -> Peer:
        connect = self._connect if self._faults is None else self._faults.wrap(self._connect)
        return connect(name, send)

    def _connect(self, _: str, send: Send) -> Peer:
        return _Modules(self._line, send)

    def run(self, seconds: float) -> None:
        end = self._rig.now + round(seconds * HZ)
        while (due := self._timing.next_event()) < end:
            self._go(due)
        self._go(end)

    def run_until(self, holds: Callable[[], Any], timeout: float, *, events_only: bool = False) -> bool:
        del events_only
        end = self._rig.now + clocks(timeout)
        while not (held := bool(holds())) and self._rig.now < end:
            self._go(min(end, self._rig.next_event(), self._timing.next_event()))
        return held

    def _go(self, when: int) -> None:
        run_until(self._rig, max(self._rig.now, when))
        run_until(self._timing, self._rig.now)


class _Modules:
    """All modules of a rig on one line, those at its bit rate."""

    def __init__(self, line: RigLine, send: Send) -> None:
        self._line = line
        self._ports = [SerialPort(module, send) for module in line.rig.modules]

    def receive(self, data: bytes) -> None:
        for port in self._ports:
            if port.baud_rate == self._line.baud:
                port.receive(data)

    def disconnect(self) -> None:
        for port in self._ports:
            port.module.detach(port)


def open_line(url: Url) -> RigLine:
    """The line of a new module, or of the bench that the URL names.  Raises `LinkError`."""
    try:
        rig = _rig(url)
    except (BenchError, EepromError) as error:
        raise LinkError(f"{url.text}: {error}") from error
    return RigLine(rig, url.baud, url.text)


def _rig(url: Url) -> Rig:
    bench, image = url.options.get("bench"), url.options.get("eeprom")
    eeprom = None if image is None else Eeprom.from_bytes(_read(image))
    if bench is not None:
        from tmcm34x.bench.builder import load

        return load(bench, [eeprom])
    model = int(url.target) if url.target else eeprom.model if eeprom else DEFAULT_MODEL
    return simple_rig(model, eeprom, seed=int(url.options.get("seed", "0"), 0), address=url.address)


def _read(path: str) -> bytes:
    from pathlib import Path

    from tmcm34x.files import read_bytes

    try:
        return read_bytes(Path(path))
    except OSError as error:
        raise EepromError(f"{path}: {error.strerror}") from error
