"""A host's line to a module in this process, in virtual time.

Telegrams take their time on the wire, ten bits a byte at the line's bit rate, so that a host that asks again and again
lets time pass as it would at a machine.  Waiting costs nothing: time goes on by itself while the host reads or sleeps.

`host.line` opens it for URLs such as `virtual:343?bench=stage.toml&seed=1`.
"""

from __future__ import annotations

from typing import Final

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


class RigLine:
    """The serial line of all modules of `rig`.

    baud: bits per second; a module at another one receives nothing
    faults: of the line
    """

    real = False

    def __init__(
        self, rig: Rig, baud: int = BAUD_RATES[0], name: str = "virtual", faults: Faults | None = None
    ) -> None:
        self.rig = rig
        self.name = name
        self.baud = baud
        self._timing = VirtualTiming(rig.now)
        if faults is not None:
            faults.timing = self._timing
        self._client = MemoryClient(self._connect if faults is None else faults.wrap(self._connect))

    def _connect(self, _: str, send: Send) -> Peer:
        return _Modules(self, send)

    def write(self, data: bytes) -> None:
        """Send `data`; it arrives when its last bit has."""
        self._pass(self._wire_s(data))
        self._client.write(data)

    def read(self, size: int, timeout_s: float) -> bytes:
        """At least `size` bytes, or what has come within `timeout_s` of virtual time."""
        data = self._client.read()
        end = self.rig.now + clocks(timeout_s)
        while len(data) < size and self.rig.now < end:
            self._until(min(end, self.rig.next_event(), self._timing.next_event()))
            data += self._client.read()
        self._pass(self._wire_s(data))
        return data

    def waiting(self) -> bytes:
        """What has come already."""
        return self._client.read()

    def now(self) -> float:
        """Virtual time."""
        return seconds(self.rig.now)

    def sleep(self, seconds: float) -> None:
        """Let virtual time pass."""
        self._pass(seconds)

    def follow(self, change: Follow, address: int) -> int:
        """Change the bit rate, or the address."""
        if change.baud is not None:
            self.baud = change.baud
        return address if change.address is None else change.address

    def close(self) -> None:
        """Hang up."""
        self._client.close()

    def _wire_s(self, data: bytes) -> float:
        return len(data) * BITS_PER_BYTE / self.baud

    def _pass(self, seconds: float) -> None:
        end = self.rig.now + round(seconds * HZ)
        while (due := self._timing.next_event()) < end:
            self._until(due)
        self._until(end)

    def _until(self, when: int) -> None:
        run_until(self.rig, max(self.rig.now, when))
        run_until(self._timing, self.rig.now)


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
