"""Benches for the tests of this folder."""

from tmcm34x.bench import build
from tmcm34x.bench.description import parse
from tmcm34x.clock import MS, run_until
from tmcm34x.tmcl.mnemonic import parse_instruction


def rig_of(text):
    return build(parse(text))


def say(rig, line, module=0):
    """Execute a command in direct mode; returns its value, which must be a success."""
    status, value = rig.modules[module].execute(parse_instruction(line))
    assert status >= 100, f"{line}: status {status}"
    return value


def run_ms(rig, milliseconds):
    run_until(rig, rig.now + round(milliseconds * MS))


def view(rig, motor=0, module=0):
    return rig.worlds[module].view()[motor]


def run_while(rig, condition, limit_ms=60_000):
    """Run from event to event as long as a condition holds."""
    limit = rig.now + limit_ms * MS
    while condition():
        assert rig.now < limit, "it never ends"
        rig.advance(min(rig.next_event(), limit))
