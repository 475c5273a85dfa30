"""Tells pyserial of the URL `tmcm34x://343`."""

from __future__ import annotations


def register_url() -> None:
    """Let pyserial open `tmcm34x://343` and the like, wherever it takes a URL."""
    import serial

    handlers: list[str] = serial.protocol_handler_packages
    if __package__ and __package__ not in handlers:
        handlers.append(__package__)
