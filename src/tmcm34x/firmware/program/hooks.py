"""Observers that are asked before commands of a program are executed, and at which addresses."""

from __future__ import annotations

from collections.abc import Callable

Ask = Callable[[int], bool]
"""Asked with the address of a command about to be executed; true stops the program there."""


class Hooks:
    """The observers and their addresses; they are not part of the program's state."""

    def __init__(self) -> None:
        self._addresses: dict[Ask, frozenset[int] | None] = {}
        """None: before all commands."""

    @property
    def wanted(self) -> bool:
        """Whether an observer is asked at all."""
        return bool(self._addresses)

    @property
    def everywhere(self) -> bool:
        """Whether one is asked before each command."""
        return None in self._addresses.values()

    @property
    def addresses(self) -> frozenset[int]:
        """Where the others are asked."""
        return frozenset[int]().union(*(of for of in self._addresses.values() if of is not None))

    def put(self, ask: Ask, addresses: frozenset[int] | None) -> None:
        """Have `ask` asked at these addresses and no others."""
        self._addresses[ask] = addresses

    def drop(self, ask: Ask) -> bool:
        """Ask it no more; whether it was asked."""
        found = ask in self._addresses
        self._addresses.pop(ask, None)
        return found

    def stop(self, address: int) -> bool:
        """Ask all of this address; whether one of them stops the program there."""
        answers = [
            ask(address)
            for ask, addresses in tuple(self._addresses.items())
            if addresses is None or address in addresses
        ]
        return any(answers)
