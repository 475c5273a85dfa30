"""States of a bench as a history keeps them: quick to take, and small.

Only for this process: `bench.snapshot` has the form that is written to files.
"""

from __future__ import annotations

import pickle
from typing import TYPE_CHECKING, Any, Final, NamedTuple

if TYPE_CHECKING:
    from tmcm34x.bench import Rig

_IMAGE: Final = 2
"""Which part of a module's state its EEPROM image is."""


class PackedState(NamedTuple):
    """All that a rig remembers.

    rest: everything besides the images
    images: of the modules' EEPROMs, which seldom change; states of the same image share it
    """

    rest: bytes
    images: tuple[bytes, ...]


def pack_state(rig: Rig) -> PackedState:
    """The state of `rig`."""
    now, happened, modules, worlds = _saved(rig)
    rest = now, happened, [module[:_IMAGE] + module[_IMAGE + 1 :] for module in modules], worlds
    return PackedState(pickle.dumps(rest, 5), tuple([module[_IMAGE] for module in modules]))


def _saved(rig: Rig) -> Any:
    return rig.save()


def load_state(rig: Rig, state: PackedState) -> None:
    """Have `rig` become as the one of the same description was."""
    now, happened, parts, worlds = pickle.loads(state.rest)
    images = zip(parts, state.images, strict=True)
    modules = tuple([(*part[:_IMAGE], image, *part[_IMAGE:]) for part, image in images])
    rig.load((now, happened, modules, worlds))
