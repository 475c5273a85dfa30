"""`--parameters`: which parameters a virtual module has."""

from __future__ import annotations

from typing import TYPE_CHECKING

import click

from tmcm34x.tmcl.axis_parameters import PROFILES

if TYPE_CHECKING:
    from tmcm34x.bench import Rig

option = click.option(
    "--parameters",
    type=click.Choice(PROFILES),
    help="later: axis parameters 141, 197, 200, 207 and global parameters 82, 87, 131 of the vendor's later firmware "
    "exist too, which host programs for sister modules may need.  [default: the bench's, or standard]",
)


def apply(profile: str | None, rig: Rig) -> None:
    """Give the modules of `rig` the profile that was asked for, if any."""
    if profile is not None:
        for module in rig.modules:
            module.take_profile(profile)
