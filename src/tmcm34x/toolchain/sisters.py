"""What programs of sister modules hold that a TMCM-34x does not have: whose it is, and what there is instead.

Source: the vendor's host library names the parameters of each module; the meaning is put in our words.
"""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType
from typing import Final, NamedTuple


class Sister(NamedTuple):
    """Whose a command or parameter is, and what a TMCM-34x offers for it."""

    owner: str
    instead: str


_INTERRUPTS: Final = Sister(
    "modules with interrupts (TMCM-1110 and newer)",
    "JC with the error flags, and loops that read inputs",
)
_VECTORS: Final = Sister(
    "newer firmware (TMCL 1.x on modules such as the TMCM-1260)",
    "CALC and CALCX with user variables (bank 2)",
)
_INDIRECT: Final = Sister(
    "newer firmware (TMCL 1.x)",
    "AAP, AGP and ACO with the accumulator and a number of their own",
)
_STACK: Final = Sister(
    "newer firmware (TMCL 1.x)",
    "AGP and GGP with a user variable (bank 2)",
)

COMMANDS: Final[Mapping[str, Sister]] = MappingProxyType({
    **dict.fromkeys(("EI", "DI", "VECT", "RETI"), _INTERRUPTS),
    **dict.fromkeys(("CALCVV", "CALCVA", "CALCAV", "CALCVX", "CALCXV", "CALCV", "SIV", "GIV", "AIV"), _VECTORS),
    **dict.fromkeys(("SAPX", "GAPX", "AAPX", "MVPA", "MVPXA", "ROLA", "RORA", "ROLXA", "RORXA", "MSTX"), _INDIRECT),
    **dict.fromkeys(("PUSHA", "PUSHX", "PUSHV", "POPA", "POPX", "POPV"), _STACK),
    "RST": Sister("newer firmware (TMCL 1.x)", "JA to the first label"),
    "DJNZ": Sister("newer firmware (TMCL 1.x)", "GGP, CALC SUB, 1, AGP and JC NZ"),
    "CALL": Sister("newer firmware (TMCL 1.x), which calls on a condition", "JC around a CSUB"),
})  # fmt: skip
"""Commands of other firmware, by name."""

_CLOSED_LOOP: Final = Sister(
    "closed-loop modules (TMC4361, such as the TMCM-1111)", "an encoder on a TMCM-323: 209, 210 and 212"
)
_PHASES: Final = Sister(
    "modules with a ramp of several phases (TMC5xxx, TMC43xx)", "4 and 5 with the divisors 153 and 154"
)
_COOL_STEP: Final = Sister(
    "modules with coolStep and stallGuard2 drivers", "6, 7 and 204 for currents; 205 and 206 for stalls"
)
_RANGES: Final = (
    (range(14, 50), _PHASES),
    (range(108, 127), _CLOSED_LOOP),
    (range(127, 128), Sister("newer modules", "MVP REL, which counts from the actual position")),
    (range(129, 138), _CLOSED_LOOP),
    (range(141, 142), Sister("newer modules", "the modes of parameter 193")),
    (range(160, 162), Sister("modules with TMC26x drivers", "the resolution 140, up to 64 microsteps")),
    (range(162, 168), Sister("modules with TMC26x or newer drivers (chopper)", "mixed decay, 203")),
    (range(168, 185), _COOL_STEP),
    (range(185, 193), Sister("modules with stealthChop drivers", "mixed decay, 203")),
    (range(197, 200), Sister("newer firmware", "GAP 1 when the search is over")),
    (range(200, 201), Sister("newer firmware (boost current)", "6, absolute max. current")),
    (range(201, 203), Sister("newer modules with encoders", "the encoder prescaler, 210")),
    (range(207, 208), Sister("newer firmware (extended error flags)", "208, driver error flags")),
    (range(215, 219), Sister("modules with an absolute or external encoder", "an encoder on a TMCM-323: 209")),
    (range(251, 256), Sister("newer modules", "the wiring of the motor, or signs in the program")),
)  # fmt: skip


def axis_parameter(number: int) -> Sister | None:
    """Whose axis parameter a number is; None where no sister module is known to have it."""
    return next((sister for numbers, sister in _RANGES if number in numbers), None)
