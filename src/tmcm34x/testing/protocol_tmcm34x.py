"""The URL handler of pyserial for virtual modules in this process.

    tmcm34x.testing.register_url()
    port = serial.serial_for_url("tmcm34x://343?bench=machine.toml", timeout=1)

`tmcm34x://341`, `342` or `343` opens a fresh module that ends when the port is closed; `bench` names a bench file,
`seed` and `pace` are those of `VirtualModule`.  `tmcm34x://NAME` opens a line to a `VirtualModule` by its name.

In virtual time nothing is waited for: a read that has to wait lets the module's time pass instead, up to the port's
time-out.  pyserial looks for the class `Serial` in a module of this name.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final, cast
from urllib.parse import parse_qs, urlsplit

from serial.serialutil import PortNotOpenError, SerialBase, SerialException

from tmcm34x.bench.rig import BenchError
from tmcm34x.testing.virtual import VirtualModule, open_modules

if TYPE_CHECKING:
    from tmcm34x.links import Peer
    from tmcm34x.testing.times import Pace

MODELS: Final = ("341", "342", "343")
LONGEST_S: Final = 3600.0
"""How much of the module's time a read without time-out takes at most."""
_LOOK_S: Final = 0.001
_OPTIONS: Final = frozenset({"bench", "seed", "pace"})


class Serial(SerialBase):
    """A port with a virtual module at its other end."""

    def __init__(self, *args: Any, **kwargs: Any) -> None:
        self._module: VirtualModule | None = None
        self._own = False
        self._peer: Peer | None = None
        self._received = bytearray()
        super().__init__(*args, **kwargs)

    def open(self) -> None:
        """Open the line.  Raises `SerialException`."""
        if self.is_open:
            raise SerialException("Port is already open.")
        self._module, self._own = _find(self.port or "")
        self._received.clear()
        self._peer = self._module.do(self._plug)
        self.is_open = True

    def _plug(self) -> Peer:
        return self._opened.connect_line("url", self._received.extend)

    def close(self) -> None:
        """Close the line, and the module if it was opened with it."""
        if self._module is not None and self._peer is not None:
            self._module.do(self._peer.disconnect)
            if self._own:
                self._module.close()
        self._module = self._peer = None
        self.is_open = False

    @property
    def _opened(self) -> VirtualModule:
        if self._module is None:
            raise PortNotOpenError
        return self._module

    @property
    def module(self) -> VirtualModule:
        """The module at the other end, to look at and to work on."""
        return self._opened

    def write(self, b: Any, /) -> int:
        """Send bytes."""
        module, peer, data = self._opened, self._peer, bytes(b)
        assert peer is not None
        module.do(lambda: peer.receive(data))
        return len(data)

    def read(self, size: int = 1, /) -> bytes:
        """Up to `size` bytes; time passes until they have come or the time-out is over."""
        module, received = self._opened, self._received
        timeout_s = self.timeout
        if len(received) < size and timeout_s != 0:
            longest_s = LONGEST_S if timeout_s is None else timeout_s * module.speed
            enough = module.run_until(lambda: len(received) >= size, longest_s, events_only=True)
            if not enough and timeout_s is None:
                raise SerialException(f"nothing came within {LONGEST_S:g} s, and the port has no time-out")
        data = bytes(received[:size])
        del received[:size]
        return data

    @property
    def in_waiting(self) -> int:
        """Bytes that have come; a little time passes when there are none, so that a host can wait in this way."""
        if not self._received and not self._opened.real_pace:
            self._opened.run(_LOOK_S)
        return len(self._received)

    @property
    def out_waiting(self) -> int:
        """All bytes are sent at once."""
        return 0

    def reset_input_buffer(self) -> None:
        """Forget what has come."""
        self._received.clear()

    def reset_output_buffer(self) -> None:
        """Nothing waits to be sent."""

    def _reconfigure_port(self, *_: Any, **__: Any) -> None:
        """Bit rate and time-outs have no effect on a line inside a process."""

    def _update_dtr_state(self) -> None: ...
    def _update_rts_state(self) -> None: ...
    def _update_break_state(self) -> None: ...

    cts = dsr = cd = True
    ri = False


def _find(url: str) -> tuple[VirtualModule, bool]:
    """The module that a URL names, and whether it is a fresh one."""
    parts = urlsplit(url)
    name = parts.netloc
    if name in open_modules:
        return open_modules[name], False
    if name not in MODELS:
        raise SerialException(f"{url}: expected tmcm34x://341, 342 or 343, or the name of an open module")
    options = {key: values[-1] for key, values in parse_qs(parts.query, keep_blank_values=True).items()}
    if unknown := options.keys() - _OPTIONS:
        raise SerialException(
            f"{url}: unknown option {min(unknown)}; there are {', '.join(sorted(_OPTIONS))}"
        )
    try:
        module = VirtualModule(
            int(name),
            bench=options.get("bench"),
            seed=_seed(options.get("seed", "0")),
            pace=_pace(options.get("pace", "virtual")),
        )
    except (BenchError, ValueError) as error:
        raise SerialException(f"{url}: {error}") from None
    return module, True


def _seed(text: str) -> int:
    try:
        return int(text)
    except ValueError:
        raise ValueError(f"seed is a whole number, not {text!r}") from None


def _pace(text: str) -> Pace:
    try:
        return float(text)
    except ValueError:
        return cast("Pace", text)  # `VirtualModule` says what there is
