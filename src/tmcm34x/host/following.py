"""What a host must do when a module takes up another address, bit rate or identifier.

Source: manual 8.1 (65, 66, 69, 70, 71).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Final

from tmcm34x.host.steps import NUMBERS, Follow
from tmcm34x.host.url import Url
from tmcm34x.tmcl.datagram import Instruction
from tmcm34x.tmcl.global_parameters import BAUD_RATES, BY_KEY, CAN_BIT_RATES

_FOLLOW: Final[Mapping[str, Callable[[int], Follow]]] = {
    "serial_address": lambda value: Follow(address=value),
    "baud_rate": lambda value: Follow(baud=BAUD_RATES[value]),
    "can_id": lambda value: Follow(can_id=value),
    "can_reply_id": lambda value: Follow(can_reply=value),
    "can_bit_rate": lambda value: Follow(can_bit_rate=CAN_BIT_RATES[value]),
}
"""By key of a global parameter: what follows from its new value."""
_BY_NUMBER: Final = {BY_KEY[key].number: follow for key, follow in _FOLLOW.items()}
_SGP: Final = NUMBERS["SGP"]


def following(instruction: Instruction) -> Follow | None:
    """What to do after a command that the module has executed; None for all that leave the line as it is."""
    follow = _BY_NUMBER.get(instruction.type)
    if instruction.number != _SGP or instruction.motor != 0 or follow is None:
        return None
    return follow(instruction.value)


def followed(url: Url, change: Follow) -> Url:
    """The name of the line after a change, where it has what has changed."""
    options = (
        {"id": change.can_id, "reply": change.can_reply, "bitrate": change.can_bit_rate}
        if url.is_can
        else {"address": change.address, "baud": change.baud if url.scheme == "serial" else None}
    )
    return url.replaced(**{name: value for name, value in options.items() if value is not None})
