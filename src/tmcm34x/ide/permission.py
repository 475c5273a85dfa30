"""Which requests of the Debug Adapter Protocol could set a motor in motion, and whether they may."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any, Final

from tmcm34x.debug.expressions import split_assignment
from tmcm34x.tmcl.mnemonic import MnemonicError, parse_instruction

if TYPE_CHECKING:
    from tmcm34x.ide.authority import Authority

_GOING: Final = frozenset({"continue", "next", "stepIn", "stepOut", "restart", "restartFrame", "goto"})
"""Requests after which the program goes on."""
_ALONG: Final = frozenset({"continue", "next", "stepIn", "stepOut"})
"""Those that move along the history while a past moment is shown."""
_CHANGING: Final = frozenset({"setVariable", "setExpression"})

Permit = Callable[[str, Mapping[str, Any]], None]
"""Takes a request's command and arguments; raises `wire.RefusalError` where it may not be done."""


def permission(of: Callable[[], Authority], past: Callable[[], bool] = lambda: False) -> Permit:
    """What a debugger must ask before each request.

    of: gives the authority over the present module; past: whether a past moment is shown
    """

    def permit(command: str, arguments: Mapping[str, Any]) -> None:
        authority = of()
        if command in _ALONG and past():
            return
        if command in _GOING:
            authority.permit_program()
        elif command in _CHANGING:
            authority.permit_motion(())
        elif command == "evaluate" and arguments.get("context") == "repl":
            _permit_text(authority, str(arguments.get("expression", "")))

    return permit


def _permit_text(authority: Authority, text: str) -> None:
    """In the console a text may be an assignment, or a command in direct mode."""
    if split_assignment(text) is not None:
        authority.permit_motion(())
        return
    try:
        instruction = parse_instruction(text)
    except MnemonicError:
        return
    authority.permit(instruction)
