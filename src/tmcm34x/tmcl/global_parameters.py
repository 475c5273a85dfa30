"""The global parameters of chapter 8: one row each, in three banks.

Columns as in `axis_parameters`, and `bank`.  In bank 0 the parameters 64..127 live in the EEPROM: SGP stores them at
once, and while the EEPROM is locked it answers status 5, unless a row is `writable_when_locked`.  Bank 1 is not there
on a TMCM-34x.  Bank 2 holds the user variables; STGP stores one, and all come back at power-on unless parameter 85
forbids it.

Source: manual 6.7.9 to 6.7.12 and chapter 8; defaults and departures: docs/fidelity.md (TMCL).
"""

from __future__ import annotations

from types import MappingProxyType
from typing import Final, NamedTuple

from tmcm34x.tmcl.axis_parameters import LATER, Choices, Kind, kind_of
from tmcm34x.tmcl.commands import INT32_MAX, INT32_MIN, PROGRAM_SIZE, USER_VARIABLES

EEPROM_MAGIC: Final = 0xE4
"""Value of parameter 64 in an EEPROM whose contents are to be kept."""
LOCK_KEY: Final = 1234
UNLOCK_KEY: Final = 4321
FACTORY_KEY: Final = 1234
"""Value that command 137 must carry."""

BAUD_RATES: Final = (9600, 14400, 19200, 28800, 38400, 57600, 76800, 115200, 230400, 250000, 500000, 1000000)
"""Bits per second by the value of parameter 65."""
CAN_BIT_RATES: Final = MappingProxyType({
    1: 10_000, 2: 20_000, 3: 50_000, 4: 100_000, 5: 125_000, 6: 250_000, 7: 500_000, 8: 1_000_000,
})  # fmt: skip
"""Bits per second by the value of parameter 69."""


class GlobalParameter(NamedTuple):
    """One row of `GLOBAL_PARAMETERS`; the module docstring names the columns."""

    bank: int
    number: int
    key: str
    name: str
    access: str
    low: int
    high: int
    default: int
    unit: str
    meaning: str
    choices: Choices = ()
    effect: str = ""
    section: str = "8.1"
    writable_when_locked: bool = False

    @property
    def kind(self) -> Kind:
        """What its value is."""
        return kind_of(self.unit, self.low, self.high, self.choices)

    @property
    def readable(self) -> bool:
        """Whether GGP may read it."""
        return "R" in self.access

    @property
    def writable(self) -> bool:
        """Whether SGP and AGP may write it."""
        return "W" in self.access

    @property
    def stored(self) -> bool:
        """Whether the EEPROM keeps it (in bank 2: after STGP)."""
        return "E" in self.access


def _long_words(first: int, key: str, name: str, meaning: str) -> tuple[GlobalParameter, ...]:
    return tuple(
        GlobalParameter(0, first + n, f"{key}_{n}", f"{name} {n}", "RW", INT32_MIN, INT32_MAX, 0, "", meaning)
        for n in range(16)
    )


_ASKS_DRIVERS: Final = "has the motion chip exchange another datagram with the motor drivers"
_OFF_ON: Final[Choices] = ((0, "off"), (1, "on"))

GLOBAL_PARAMETERS: Final[tuple[GlobalParameter, ...]] = (
    GlobalParameter(
        0, 0, "datagram_low_word", "datagram low word", "R", 0, 0xFFFFFF, 0, "",
        "Lower 24 bits of what the motor drivers last sent to the motion chip.", effect=_ASKS_DRIVERS,
    ),
    GlobalParameter(
        0, 1, "datagram_high_word", "datagram high word", "R", 0, 0xFFFFFF, 0, "",
        "Upper 24 bits of what the motor drivers last sent to the motion chip.", effect=_ASKS_DRIVERS,
    ),
    GlobalParameter(
        0, 2, "cover_position", "cover datagram position", "RW", 0, 63, 0, "bits",
        "Where in the drivers' datagram the cover datagram is laid over it.",
    ),
    GlobalParameter(
        0, 3, "cover_length", "cover datagram length", "RW", 0, 31, 0, "bits", "How many bits are covered.",
    ),
    GlobalParameter(
        0, 4, "cover_datagram", "cover datagram contents", "RW", 0, 0xFFFFFF, 0, "",
        "The bits to send over the drivers' datagram; writing it sends them once.",
    ),
    GlobalParameter(
        0, 5, "reference_switches", "reference switch states", "R", 0, 63, 0, "bit mask",
        "All switches as the chip reads them: bit 5 left 3, 4 right 3, 3 left 2, 2 right 2, 1 left 1, 0 right 1.",
    ),
    GlobalParameter(
        0, 6, "smgp", "TMC428/TMC429 SMGP register", "RW", 0, 0xFFFFFF, 0, "",
        "The chip's global motor parameters: drivers, polarities, clock divider, switch inputs.",
    ),
    *_long_words(
        7, "driver_chain", "driver chain configuration long word",
        "Four cells of the table that describes the drivers' datagram, lowest cell in the lowest byte.",
    ),
    *_long_words(
        23, "microstep_table", "microstep table long word",
        "Four six-bit values of the quarter sine wave, lowest in the lowest byte.",
    ),
    GlobalParameter(
        0, 64, "eeprom_magic", "EEPROM magic", "RWE", 0, 255, EEPROM_MAGIC, "",
        "Any value but $E4 brings back the factory defaults at the next power-on.",
    ),
    GlobalParameter(
        0, 65, "baud_rate", "RS232/RS485 baud rate", "RWE", 0, 11, 0, "",
        "Speed of the serial interface.", tuple((n, f"{rate} baud") for n, rate in enumerate(BAUD_RATES)),
    ),
    GlobalParameter(
        0, 66, "serial_address", "serial address", "RWE", 0, 255, 1, "", "Address of the module on RS232 and RS485.",
    ),
    GlobalParameter(
        0, 67, "ascii_mode", "ASCII mode", "RWE", 0, 255, 0, "bit mask",
        "Bit 0: start in ASCII mode. Bits 5 and 4: echo of each character (00), of the whole line (01), none (10).",
    ),
    GlobalParameter(
        0, 68, "serial_heartbeat", "serial heartbeat", "RWE", 0, 65535, 0, "ms",
        "The motors are stopped when no command comes for this time; 0 switches the watch off.",
    ),
    GlobalParameter(
        0, 69, "can_bit_rate", "CAN bit rate", "RWE", 1, 8, 8, "", "Speed of the CAN interface.",
        tuple((n, f"{rate // 1000} kbit/s") for n, rate in CAN_BIT_RATES.items()),
    ),
    GlobalParameter(
        0, 70, "can_reply_id", "CAN reply ID", "RWE", 0, 0x7FF, 2, "", "CAN identifier of the module's replies.",
    ),
    GlobalParameter(
        0, 71, "can_id", "CAN ID", "RWE", 0, 0x7FF, 1, "", "CAN identifier that the module listens to.",
    ),
    GlobalParameter(
        0, 73, "eeprom_lock", "configuration EEPROM lock flag", "RWE", 0, 4321, 0, "",
        "Write 1234 to lock the configuration EEPROM, 4321 to unlock it; reads 1 while locked.",
        writable_when_locked=True,
    ),
    GlobalParameter(
        0, 74, "encoder_interface", "encoder interface", "RWE", 0, 3, 0, "",
        "Where a TMCM-323 encoder module is connected.",
        ((0, "none"), (1, "SPI_SEL0"), (2, "SPI_SEL1"), (3, "SPI_SEL2")),
    ),
    GlobalParameter(
        0, 75, "telegram_pause", "telegram pause time", "RWE", 0, 255, 0, "ms",
        "Wait before a reply on RS232 or RS485; RS485 adapters switched by RTS need about 15.",
    ),
    GlobalParameter(
        0, 76, "host_address", "serial host address", "RWE", 0, 255, 2, "", "First byte of serial replies.",
    ),
    GlobalParameter(
        0, 77, "auto_start", "auto start mode", "RWE", 0, 1, 0, "", "1 starts the stored program at power-on.", _OFF_ON,
    ),
    GlobalParameter(
        0, 80, "shutdown_pin", "shutdown pin functionality", "RWE", 0, 2, 0, "",
        "What the SHUTDOWN pin does: nothing, or stop all motors while high or while low.",
        ((0, "no function"), (1, "high active"), (2, "low active")),
    ),
    GlobalParameter(
        0, 81, "code_protection", "TMCL code protection", "RWE", 0, 3, 0, "",
        "Forbids reading (1), overwriting (2) or both (3) of the program; giving up 1 or 3 erases the program.",
        ((0, "none"), (1, "against reading"), (2, "against overwriting"), (3, "against both")),
    ),
    GlobalParameter(
        0, 83, "can_secondary_id", "CAN secondary address", "RWE", 0, 0x7FF, 0, "",
        "Second CAN identifier that the module listens to; 0 is none.",
    ),
    GlobalParameter(
        0, 84, "coordinate_storage", "coordinate storage", "RWE", 0, 1, 0, "",
        "Where coordinates 1 to 20 are stored.", ((0, "RAM"), (1, "EEPROM")),
    ),
    GlobalParameter(
        0, 85, "keep_user_variables_cleared", "do not restore user variables", "RWE", 0, 1, 0, "",
        "1 leaves the user variables at 0 at power-on.", ((0, "restore"), (1, "do not restore")),
    ),
    GlobalParameter(
        0, 128, "application_status", "TMCL application status", "R", 0, 3, 0, "", "What the program is doing.",
        ((0, "stop"), (1, "run"), (2, "step"), (3, "reset")),
    ),
    GlobalParameter(
        0, 129, "download_mode", "download mode", "R", 0, 1, 0, "", "1 while commands are stored instead of executed.",
    ),
    GlobalParameter(
        0, 130, "program_counter", "TMCL program counter", "R", 0, PROGRAM_SIZE, 0, "",
        "Address of the command being executed.",
    ),
    GlobalParameter(
        0, 132, "tick_timer", "tick timer", "RW", INT32_MIN, INT32_MAX, 0, "ms", "Counts milliseconds; may be set.",
    ),
    GlobalParameter(
        0, 133, "random_number", "random number", "R", 0, INT32_MAX, 0, "", "Another number at each reading.",
        effect="draws the next number",
    ),
    GlobalParameter(
        0, 255, "disable_reply", "disable reply", "RW", 0, 1, 0, "", "1 keeps the module from answering.", _OFF_ON,
    ),
    *(
        GlobalParameter(
            2, n, f"user_variable_{n}", f"general purpose variable #{n}", "RWE", INT32_MIN, INT32_MAX, 0, "",
            "Free for TMCL programs.", section="8.3",
        )
        for n in range(USER_VARIABLES)
    ),
)  # fmt: skip
"""All global parameters, by bank and number."""

LATER_GLOBAL_PARAMETERS: Final[tuple[GlobalParameter, ...]] = (
    GlobalParameter(
        0, 82, "can_heartbeat", "CAN heartbeat", "RWE", 0, 65535, 0, "ms",
        "The motors are stopped when no command comes on CAN for this time; 0 switches the watch off.", section="",
    ),
    GlobalParameter(
        0, 87, "serial_secondary_address", "serial secondary address", "RWE", 0, 255, 0, "",
        "Second address of the module on RS232 and RS485; 0 is none.", section="",
    ),
    GlobalParameter(
        0, 131, "last_error", "TMCL last error", "R", 0, 255, 0, "",
        "Status of the command of the program that was refused last; 0 is none.", section="",
    ),
)  # fmt: skip
"""Global parameters of later firmware, which a module with the profile "later" has too (fidelity TMCL-18)."""

BY_NUMBER: Final = MappingProxyType({(row.bank, row.number): row for row in GLOBAL_PARAMETERS})
BY_KEY: Final = MappingProxyType({row.key: row for row in GLOBAL_PARAMETERS})


def global_rows(profile: str) -> tuple[GlobalParameter, ...]:
    """The global parameters of bank 0 with a profile."""
    later = LATER_GLOBAL_PARAMETERS if profile == LATER else ()
    return tuple(row for row in (*GLOBAL_PARAMETERS, *later) if row.bank == 0)
