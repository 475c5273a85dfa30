"""The ASCII interface: command lines instead of telegrams on a serial port.

A line is an address letter ("A" is module 1, "a" is module 33), a command as in the TMCL-IDE, and a carriage
return.  The answer is the host's letter, the module's letter, a status and a value: `BA 100 -5000`.  Lines for other
modules are neither echoed nor answered.  Line feeds mean nothing, so that terminals may send either line end.

Missing operands count as 0, and commas may stand wherever blanks may: real clients send `AMST` and
`ASAP, 4, 0, 996`.

Source: manual 6.6; fidelity PROG-40 to PROG-46.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final, Protocol

from tmcm34x.tmcl.commands import BY_MNEMONIC
from tmcm34x.tmcl.datagram import Instruction
from tmcm34x.tmcl.mnemonic import MnemonicError, parse_instruction
from tmcm34x.tmcl.numbers import CONTROL, GP
from tmcm34x.tmcl.status import Status

if TYPE_CHECKING:
    from tmcm34x.clock import Value
    from tmcm34x.firmware.module import FirmwareModule

LONGEST_LINE: Final = 80
"""Characters that are kept of a line; a longer one is an invalid command."""
_OWN: Final = {
    "RUN": (Instruction(CONTROL.RESET_APPLICATION), Instruction(CONTROL.RUN_APPLICATION)),
    "STOP": (Instruction(CONTROL.STOP_APPLICATION),),
}
"""Commands of this interface alone: the program runs from its start, or stops (manual 6.6.3)."""
_ECHO_BITS: Final = 0x30
_ECHO_CHARACTERS: Final = 0x00
_ECHO_LINE: Final = 0x10
_RETURN: Final = 0x0D
_LINE_FEED: Final = 0x0A
_ERASE: Final = frozenset({0x08, 0x7F})
_ERASED: Final = b"\x08 \x08"


class TextPort(Protocol):
    """What a command line needs of its serial port."""

    module: FirmwareModule

    @property
    def ascii_mode(self) -> bool:
        """Whether the port speaks ASCII lines instead of telegrams."""
        ...

    def enter_text(self, on: bool) -> None:
        """Speak ASCII lines from now on, or telegrams."""
        ...

    def receive(self, data: bytes) -> None:
        """Take bytes from the line."""
        ...

    def transmit(self, data: bytes) -> None:
        """Send bytes."""
        ...

    def execute(self, instruction: Instruction) -> tuple[int, int]:
        """Execute a command; status and value of the reply."""
        ...


class AsciiLine:
    """The command line of one serial port."""

    __slots__ = ("_line", "_module", "_output", "_port")

    def __init__(self, port: TextPort) -> None:
        self._port = port
        self._module = port.module
        self._line = bytearray()
        self._output = bytearray()

    def answer(self, data: bytes) -> bytes:
        """The echo and the replies to characters that arrived.

        Whatever follows a line with BIN goes to the port again, as telegrams.
        """
        for n, character in enumerate(data, 1):
            self._take(character)
            if not self._port.ascii_mode:
                self._port.transmit(self._taken())
                self._port.receive(data[n:])
                break
        return self._taken()

    def save(self) -> Value:
        """The line so far."""
        return bytes(self._line)

    def load(self, value: Any) -> None:
        """Go back to what `save` gave."""
        self._line = bytearray(value)

    def _taken(self) -> bytes:
        output = bytes(self._output)
        self._output.clear()
        return output

    @property
    def _echo(self) -> int:
        return self._module.eeprom.global_values[GP.ASCII_MODE] & _ECHO_BITS

    @property
    def _addressed(self) -> bool:
        """Whether the line so far begins with the module's letter."""
        return bytes(self._line[:1]) == letter(self._module.address)

    def _take(self, character: int) -> None:
        if character == _LINE_FEED:
            return
        if character in _ERASE:
            self._erase()
            return
        if character != _RETURN and len(self._line) <= LONGEST_LINE:
            self._line.append(character)
        addressed = self._addressed
        if addressed and self._echo == _ECHO_CHARACTERS:
            self._output.append(character)
        if character == _RETURN:
            line = bytes(self._line)
            self._line.clear()
            if addressed:
                self._answer(line)

    def _erase(self) -> None:
        if self._line:
            if self._addressed and self._echo == _ECHO_CHARACTERS:
                self._output += _ERASED
            self._line.pop()

    def _answer(self, line: bytes) -> None:
        if self._echo == _ECHO_LINE:
            self._output += line + b"\r"
        host, own = letter(self._module.host_address), letter(self._module.address)
        too_long = len(line) > LONGEST_LINE
        status, value = (Status.INVALID_COMMAND, 0) if too_long else self._execute(line[1:].decode("latin-1"))
        if status < Status.OK:
            self._module.refused(status)
        self._output += b"%b%b %d %d\r" % (host, own, status, value)

    def _execute(self, line: str) -> tuple[int, int]:
        words = line.replace(",", " ").split()
        name = words[0].upper() if words else ""
        if name == "BIN":
            self._port.enter_text(False)
            return Status.OK, 0
        if name in _OWN:
            return [self._port.execute(instruction) for instruction in _OWN[name]][-1]
        row = BY_MNEMONIC.get(name)
        if row is None:
            return Status.INVALID_COMMAND, 0
        if "ascii" not in row.where:
            return Status.NOT_AVAILABLE, 0
        missing = sum(operand.required for operand in row.operands) - (len(words) - 1)
        try:
            instruction = parse_instruction(" ".join([*words, *["0"] * missing]))
        except MnemonicError:
            return Status.INVALID_VALUE, 0
        return self._port.execute(instruction)


def letter(address: int) -> bytes:
    """The address character of a module or host: "A" for 1, "B" for 2 and so on."""
    return bytes((ord("A") - 1 + address & 0xFF,))
