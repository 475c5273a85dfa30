"""The commands of TMCL: one row each.

A row says how a command is written (operands in source order), where it may be used, and whether it reads a
value.  Columns:

number      opcode, the second byte of a datagram
mnemonic    name in source text, upper case; empty for control functions, which have none
operands    in source order, each with the field of the binary format that it fills
where       words: `direct` (binary telegram, manual 6), `program` (stand-alone), `ascii` (6.6.3),
            `reads` (a program gets the value into the accumulator), `group` (also done by the motors of the
            same group index, axis parameter 213), `control` (host control function, 6.7.36)
section     of the manual
title       short name
meaning     what it does, in our words
key         name of a control function in code

Source: manual 6.4 to 6.7 with the corrections in docs/fidelity.md (TMCL).
"""

from __future__ import annotations

from types import MappingProxyType
from typing import Final, Literal, NamedTuple

Field = Literal["type", "motor", "value"]
Kind = Literal[
    "word", "motor", "number", "address", "axis_parameter", "global_parameter", "bank", "port", "coordinate"
]

INT32_MIN: Final = -(2**31)
INT32_MAX: Final = 2**31 - 1
POSITION_MIN: Final = -(2**23)
POSITION_MAX: Final = 2**23 - 1
PROGRAM_SIZE: Final = 2048
"""Instructions in the program memory (manual 2.1)."""
MOTORS: Final = 3
COORDINATES: Final = 21
"""Coordinates 0..20; number 0 lives in RAM only (manual 6.7.25)."""
USER_VARIABLES: Final = 56
STACK_DEPTH: Final = 8
"""Nesting of CSUB (manual 6.7.20)."""

Words = tuple[tuple[str, int], ...]


class Operand(NamedTuple):
    """One operand of a command: its place in the binary format and what it may be."""

    name: str
    field: Field
    kind: Kind
    low: int
    high: int
    words: Words = ()
    """For `word`: the keywords with their numbers."""
    required: bool = True


class Command(NamedTuple):
    """One row of `COMMANDS`; the module docstring names the columns."""

    number: int
    mnemonic: str
    operands: tuple[Operand, ...]
    where: frozenset[str]
    section: str
    title: str
    meaning: str
    key: str = ""

    @property
    def spare(self) -> tuple[Field, ...]:
        """Fields that no operand fills, in binary order: surplus numbers in a source line go there.

        `GAP 1, 2, 0` has one: the value.  Source: manual 6.7.17 and 6.7.18 examples, fidelity TMCL-9.
        """
        used = {operand.field for operand in self.operands}
        fields: tuple[Field, ...] = ("type", "motor", "value")
        return tuple(field for field in fields if field not in used)

    @property
    def syntax(self) -> str:
        """How the command is written: `MVP ABS|REL|COORD, <motor>, <position>`."""
        parts = [
            "|".join(word for word, _ in o.words) if o.kind == "word" else f"<{o.name}>"
            for o in self.operands
        ]
        return f"{self.mnemonic} {', '.join(parts)}".strip()


def _words(*words: str) -> Words:
    return tuple((word, number) for number, word in enumerate(words))


def _word(name: str, words: Words) -> Operand:
    numbers = [number for _, number in words]
    return Operand(name, "type", "word", min(numbers), max(numbers), words)


def _value(name: str, low: int = INT32_MIN, high: int = INT32_MAX) -> Operand:
    return Operand(name, "value", "number", low, high)


MOVE_TYPES: Final = _words("ABS", "REL", "COORD")
RFS_TYPES: Final = _words("START", "STOP", "STATUS")
WAIT_TYPES: Final = _words("TICKS", "POS", "REFSW", "LIMSW", "RFS")
CALC_TYPES: Final = _words("ADD", "SUB", "MUL", "DIV", "MOD", "AND", "OR", "XOR", "NOT", "LOAD")
CALCX_TYPES: Final = (*CALC_TYPES, ("SWAP", 10))
CONDITIONS: Final = _words("ZE", "NZ", "EQ", "NE", "GT", "GE", "LT", "LE", "ETO", "EAL", "EDV", "EPO", "ESD")
FLAGS: Final = _words("ALL", "ETO", "EAL", "EDV", "EPO", "ESD")

_MOTOR = Operand("motor", "motor", "motor", 0, MOTORS - 1)
_MOTORS = Operand("motor", "motor", "motor", 0, 255)
_AXIS = Operand("parameter", "type", "axis_parameter", 0, 255)
_GLOBAL = Operand("parameter", "type", "global_parameter", 0, 255)
_BANK = Operand("bank", "motor", "bank", 0, 255)
_IO_BANK = Operand("bank", "motor", "bank", 0, 2)
_PORT = Operand("port", "type", "port", 0, 255)
_COORDINATE = Operand("coordinate", "type", "coordinate", 0, COORDINATES - 1)
_ADDRESS = Operand("label", "value", "address", 0, PROGRAM_SIZE - 1)
_FREE = (
    Operand("type", "type", "number", 0, 255, required=False),
    Operand("motor", "motor", "number", 0, 255, required=False),
    Operand("value", "value", "number", INT32_MIN, INT32_MAX, required=False),
)

_HOST = frozenset({"direct", "program", "ascii"})
_HOST_READ = _HOST | {"reads"}
_HOST_GROUP = _HOST | {"group"}
_REGISTER = frozenset({"direct", "program"})
_PROGRAM = frozenset({"program"})
_CONTROL = frozenset({"direct", "control"})

COMMANDS: Final[tuple[Command, ...]] = (
    Command(
        1, "ROR", (_MOTOR, _value("velocity", -2047, 2047)), _HOST_GROUP, "6.7.1", "rotate right",
        "Turns a motor in the direction of rising positions, in velocity mode, until another motion command comes.",
    ),
    Command(
        2, "ROL", (_MOTOR, _value("velocity", -2047, 2047)), _HOST_GROUP, "6.7.2", "rotate left",
        "Turns a motor in the direction of falling positions, in velocity mode.",
    ),
    Command(
        3, "MST", (_MOTOR,), _HOST_GROUP, "6.7.3", "motor stop",
        "Brings a motor to rest along its deceleration ramp: velocity mode with target speed 0.",
    ),
    Command(
        4, "MVP", (_word("mode", MOVE_TYPES), _MOTORS, _value("position")), _HOST_GROUP, "6.7.4",
        "move to position",
        "Starts a move to an absolute position, by an offset from the actual position, or to a stored coordinate. "
        "With COORD, motor may also be $80 + mask (several motors) or $40 + mask (several motors, interpolated).",
    ),
    Command(
        5, "SAP", (_AXIS, _MOTOR, _value("value")), _HOST, "6.7.5", "set axis parameter",
        "Sets a parameter of one axis; the setting is lost at power-off unless STAP stores it.",
    ),
    Command(
        6, "GAP", (_AXIS, _MOTOR), _HOST_READ, "6.7.6", "get axis parameter",
        "Reads a parameter of one axis; in a program the value goes to the accumulator.",
    ),
    Command(
        7, "STAP", (_AXIS, _MOTOR), _HOST, "6.7.7", "store axis parameter",
        "Copies the present value of an axis parameter to the EEPROM, from where it comes back at power-on.",
    ),
    Command(
        8, "RSAP", (_AXIS, _MOTOR), _HOST, "6.7.8", "restore axis parameter",
        "Copies the stored value of an axis parameter from the EEPROM back into use.",
    ),
    Command(
        9, "SGP", (_GLOBAL, _BANK, _value("value")), _HOST, "6.7.9", "set global parameter",
        "Sets a parameter of the module (bank 0, stored at once) or a user variable (bank 2).",
    ),
    Command(
        10, "GGP", (_GLOBAL, _BANK), _HOST_READ, "6.7.10", "get global parameter",
        "Reads a global parameter or a user variable; in a program the value goes to the accumulator.",
    ),
    Command(
        11, "STGP", (_GLOBAL, _BANK), _HOST, "6.7.11", "store global parameter",
        "Copies a user variable (bank 2) to the EEPROM.",
    ),
    Command(
        12, "RSGP", (_GLOBAL, _BANK), _HOST, "6.7.12", "restore global parameter",
        "Copies the stored value of a user variable (bank 2) from the EEPROM back.",
    ),
    Command(
        13, "RFS", (_word("action", RFS_TYPES), _MOTOR), _HOST_READ | {"group"}, "6.7.13", "reference search",
        "Starts or aborts the built-in search for the reference point, or asks whether it is still going on.",
    ),
    Command(
        14, "SIO", (_PORT, _IO_BANK, _value("value", -1, 255)), _HOST, "6.7.14", "set output",
        "Sets a digital output; port 255 of bank 2 sets all eight, with value -1 from the accumulator.",
    ),
    Command(
        15, "GIO", (_PORT, _IO_BANK), _HOST_READ, "6.7.15", "get input/output",
        "Reads a digital input (bank 0), an analogue input (bank 1) or an output (bank 2); port 255 reads all.",
    ),
    Command(
        19, "CALC", (_word("operation", CALC_TYPES), _value("operand")), _REGISTER, "6.7.16", "calculate",
        "Combines the accumulator with a constant and leaves the result in the accumulator.",
    ),
    Command(
        20, "COMP", (_value("value"),), _PROGRAM, "6.7.17", "compare",
        "Compares the accumulator with a constant and sets the flags that JC looks at.",
    ),
    Command(
        21, "JC", (_word("condition", CONDITIONS), _ADDRESS), _PROGRAM, "6.7.18", "jump conditional",
        "Jumps when a condition holds: the last comparison, the last result, or an error flag.",
    ),
    Command(22, "JA", (_ADDRESS,), _PROGRAM, "6.7.19", "jump always", "Continues at another address of the program."),
    Command(
        23, "CSUB", (_ADDRESS,), _PROGRAM, "6.7.20", "call subroutine",
        "Calls a subroutine; up to eight calls may be open, further ones are ignored.",
    ),
    Command(
        24, "RSUB", (), _PROGRAM, "6.7.21", "return from subroutine",
        "Returns to the command after the last open CSUB; ignored when none is open.",
    ),
    Command(
        27, "WAIT", (_word("condition", WAIT_TYPES), _MOTOR, _value("ticks", 0)), _PROGRAM, "6.7.22", "wait",
        "Holds the program until time has passed, a position, switch or reference search is done, or the time-out "
        "in ticks of 10 ms (0: none) is over, which sets the flag ETO.",
    ),
    Command(28, "STOP", (), _PROGRAM, "6.7.23", "stop program", "Ends the program."),
    Command(
        29, "SAC",
        (
            Operand("bus", "type", "number", 0, 255), Operand("bytes", "motor", "number", 1, 4),
            _value("data"),
        ),
        _HOST_READ, "6.7.24", "SPI bus access",
        "Exchanges one to four bytes with an external SPI device; bus numbers from 128 send the accumulator.",
    ),
    Command(
        30, "SCO",
        (_COORDINATE, Operand("motor", "motor", "motor", 0, 255), _value("position", POSITION_MIN, POSITION_MAX)),
        _HOST, "6.7.25", "set coordinate",
        "Sets a coordinate of one motor; motor 255 copies coordinates from RAM to EEPROM.",
    ),
    Command(
        31, "GCO", (_COORDINATE, Operand("motor", "motor", "motor", 0, 255)), _HOST_READ, "6.7.26",
        "get coordinate",
        "Reads a coordinate of one motor; motor 255 copies coordinates from EEPROM to RAM.",
    ),
    Command(
        32, "CCO", (_COORDINATE, Operand("motor", "motor", "motor", 0, 7)), _HOST, "6.7.27",
        "capture coordinate",
        "Copies the actual position of a motor, or of all three with motor 7, into a coordinate.",
    ),
    Command(
        33, "CALCX", (_word("operation", CALCX_TYPES),), _REGISTER, "6.7.29", "calculate with X",
        "Combines the accumulator with the X register, loads X, or swaps the two.",
    ),
    Command(
        34, "AAP", (_AXIS, _MOTOR), _REGISTER, "6.7.30", "accumulator to axis parameter",
        "Sets an axis parameter to the accumulator's value.",
    ),
    Command(
        35, "AGP", (_GLOBAL, _BANK), _REGISTER, "6.7.31", "accumulator to global parameter",
        "Sets a global parameter or user variable to the accumulator's value.",
    ),
    Command(
        36, "CLE", (_word("flag", FLAGS),), _PROGRAM, "6.7.32", "clear error flags",
        "Clears one error flag, or all of them.",
    ),
    Command(
        39, "ACO", (_COORDINATE, _MOTOR), _REGISTER, "6.7.28", "accumulator to coordinate",
        "Sets a coordinate of one motor to the accumulator's value.",
    ),
    *(
        Command(
            64 + n, f"UF{n}", _FREE, _HOST_READ, "6.7.33", f"user function {n}",
            "Calls a customer's own function; plain firmware has none.",
        )
        for n in range(8)
    ),
)  # fmt: skip
"""All commands with a mnemonic, by number."""

_NUMBER = Operand("address", "value", "address", 0, PROGRAM_SIZE - 1)

CONTROL_FUNCTIONS: Final[tuple[Command, ...]] = (
    Command(
        128, "", (), _CONTROL, "6.7.36", "stop application", "Stops a running program.",
        "stop_application",
    ),
    Command(
        129, "", (Operand("start", "type", "word", 0, 1, (("current", 0), ("address", 1))), _NUMBER), _CONTROL,
        "6.7.36", "run application", "Starts or continues the program, here or at an address.",
        "run_application",
    ),
    Command(
        130, "", (), _CONTROL, "6.7.36", "step application", "Executes one command of the program.",
        "step_application",
    ),
    Command(
        131, "", (), _CONTROL, "6.7.36", "reset application", "Stops the program and goes back to its start.",
        "reset_application",
    ),
    Command(
        132, "", (_NUMBER,), _CONTROL, "6.7.36", "start download mode",
        "Stores all following commands in the program memory instead of executing them.",
        "start_download",
    ),
    Command(
        133, "", (), _CONTROL, "6.7.36", "quit download mode", "Executes commands again.",
        "quit_download",
    ),
    Command(
        134, "", (_NUMBER,), _CONTROL, "6.7.36", "read program memory", "Reads one stored command.",
        "read_program_memory",
    ),
    Command(
        135, "", (), _CONTROL, "6.7.36", "get application status", "Returns 0 stop, 1 run, 2 step or 3 reset.",
        "get_application_status",
    ),
    Command(
        136, "", (Operand("form", "type", "word", 0, 1, (("string", 0), ("binary", 1))),), _CONTROL, "6.7.36",
        "get firmware version", "Returns module type and version, as eight characters or as a number.",
        "get_firmware_version",
    ),
    Command(
        137, "", (Operand("key", "value", "number", 1234, 1234),), _CONTROL, "6.7.36", "restore factory settings",
        "Puts all stored settings back to their defaults; never answered.",
        "restore_factory_settings",
    ),
    Command(
        138, "", (Operand("motors", "value", "number", 0, 7),), _CONTROL, "6.7.34",
        "request target position reached event",
        "Answers at once, and again with status 128 when all motors of the mask are at their targets.",
        "request_target_reached",
    ),
    Command(
        139, "", (), _CONTROL, "6.6", "enter ASCII mode", "Changes the serial port to the ASCII interface.",
        "enter_ascii_mode",
    ),
)  # fmt: skip
"""Functions for hosts only: no mnemonic, not allowed in a program."""

BOOT_KEY: Final = (0x81, 0x92, 0xA3B4C5D6 - 2**32)
"""Type, motor and value of command 242 that enter the boot loader (later modules' protocol)."""
BOOT_FUNCTION: Final = Command(
    242, "", (
        Operand("first key", "type", "number", BOOT_KEY[0], BOOT_KEY[0]),
        Operand("second key", "motor", "number", BOOT_KEY[1], BOOT_KEY[1]),
        Operand("third key", "value", "number", BOOT_KEY[2], BOOT_KEY[2]),
    ),
    _CONTROL, "", "enter boot loader", "Leaves the firmware for the boot loader; never answered.",
    "enter_boot_loader",
)  # fmt: skip
"""The control function that the manual does not have (fidelity FW-88)."""

SISTER_COMMANDS: Final = MappingProxyType({
    "SAPX": 16, "GAPX": 17, "AAPX": 18, "EI": 25, "DI": 26, "VECT": 37, "RETI": 38, "CALCVV": 40, "CALCVA": 41,
    "CALCAV": 42, "CALCVX": 43, "CALCXV": 44, "CALCV": 45, "MVPA": 46, "MVPXA": 47, "RST": 48, "DJNZ": 49,
    "ROLA": 50, "RORA": 51, "ROLXA": 52, "RORXA": 53, "MSTX": 54, "SIV": 55, "GIV": 56, "AIV": 57, "PUSHA": 58,
    "PUSHX": 59, "PUSHV": 60, "POPA": 61, "POPX": 62, "POPV": 63, "CALL": 80,
})  # fmt: skip
"""Commands of other Trinamic firmwares, known so that they can be refused with a clear text."""

ASCII_COMMANDS: Final = ("BIN", "RUN", "STOP")
"""Commands of the ASCII interface alone (manual 6.6.3)."""

CONTROL_BY_KEY: Final = MappingProxyType({row.key: row for row in (*CONTROL_FUNCTIONS, BOOT_FUNCTION)})
BY_NUMBER: Final = MappingProxyType({row.number: row for row in (*COMMANDS, *CONTROL_FUNCTIONS)})
BY_MNEMONIC: Final = MappingProxyType({row.mnemonic: row for row in COMMANDS})
