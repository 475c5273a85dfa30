"""Programs to debug, and what tests of run control do with them."""

from tmcm34x.bench import simple_rig
from tmcm34x.clock import NEVER
from tmcm34x.debug.control import Breakpoint
from tmcm34x.debug.sessions.base import SourceMap
from tmcm34x.debug.sessions.bench import BenchSession
from tmcm34x.toolchain.assembler import assemble

PROGRAM = """\
        SAP   4, 0, 1200
        SGP   1, 2, 0
Loop:   CSUB  Move
        GGP   1, 2
        COMP  3
        JC    LT, Loop
        STOP
Move:   MVP   REL, 0, 2000
        CSUB  Wait
        RSUB
Wait:   WAIT  POS, 0, 0
        GGP   1, 2
        CALC  ADD, 1
        AGP   1, 2
        RSUB
"""


class Notes:
    """Writes down what a session tells."""

    def __init__(self):
        self.stops = []
        self.messages = []
        self.ends = 0

    def held(self, stop):
        self.stops.append(stop)

    def ended(self):
        self.ends += 1

    def said(self, text, address):
        self.messages.append((address, text))


def assembled(source):
    assembly = assemble(source)
    assert assembly.ok, assembly.diagnostics
    return assembly


def bench(source=PROGRAM, rig=None, **options):
    """A session on a bench of its own, and what it tells."""
    rig = rig or simple_rig()
    assembly = assembled(source)
    rig.modules[0].eeprom.write_program(assembly.program)
    notes = Notes()
    return BenchSession(rig, notes, SourceMap(assembly), **options), notes


def breakpoints(*addresses, **texts):
    return [Breakpoint.make(n, address, **texts) for n, address in enumerate(addresses)]


def go(session):
    session.resume()
    session.advance(NEVER)


PLANTED = """\
        SCO   5, 0, 200
        CSUB  Clean
        SGP   3, 2, 0
Loop:   GGP   3, 2
        CALC  ADD, 1
        AGP   3, 2
        COMP  2000
        JC    LT, Loop
        MVP   COORD, 0, 5
        WAIT  POS, 0, 0
        GAP   1, 0
        COMP  200
        JC    EQ, Good
Crash:  STOP
Good:   JA    Good
Clean:  SGP   4, 2, 0
        SCO   5, 0, 900
        RSUB
"""
"""A subroutine overwrites a coordinate ten thousand commands before the motor is found at the wrong place."""
CRASH = 14
"""The line at which that is found."""
CULPRIT = 17
"""The line that did it."""
