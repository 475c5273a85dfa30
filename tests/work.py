"""How much a call does, counted in lines of the product and not in time."""

import sys

import tmcm34x

ROOT = tmcm34x.__path__[0]


class TooMuchError(AssertionError):
    """A call that goes on and on."""


def lines_of(call, limit):
    """The number of lines of the product that `call` executes; more than `limit` end it with `TooMuchError`."""
    count = 0

    def line(frame, event, argument):
        nonlocal count
        count += event == "line"
        if count > limit:
            raise TooMuchError(f"more than {limit} lines, now in {frame.f_code.co_qualname}")
        return line

    def entered(frame, event, argument):
        return line if frame.f_code.co_filename.startswith(ROOT) else None

    before = sys.gettrace()
    sys.settrace(entered)
    try:
        call()
    finally:
        sys.settrace(before)
    return count
