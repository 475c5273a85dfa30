"""A program of a real module in single steps, over a line whose telegrams take their time."""

import pytest

from host_rigs import connected
from tmcm34x.bench.builder import build
from tmcm34x.bench.description import parse
from tmcm34x.debug.sessions.remote import RemoteSession
from tmcm34x.toolchain.assembler import assemble

PROGRAM = "Loop: SGP 1, 2, 1\n CSUB Sub\n JA Loop\nSub: SGP 2, 2, 9\n RSUB\n"


class Listener:
    def __init__(self):
        self.stops = []

    def held(self, stop):
        self.stops.append(stop)

    def said(self, text, address):
        raise AssertionError(f"there is no log point: {text} at {address}")


@pytest.mark.parametrize("instruction_ms", [0.1, 10, 25, 45])
def test_a_step_that_ends_between_two_questions_is_one_step(instruction_ms):
    """A question and its answer take 19 ms at 9600 bits per second; status and counter are two questions."""
    rig = build(parse(f"instruction_us = {instruction_ms * 1000}\n[[module]]\n"))
    program = assemble(PROGRAM).program
    rig.modules[0].eeprom.write_program(program)
    listener = Listener()
    session = RemoteSession(connected(rig), listener)
    session.loaded(program)
    for step in (session.step_over, session.step_over, session.step_over, session.step_over, session.step_in):
        step()
        while session.running:
            session.work()
    assert [(stop.reason, stop.address) for stop in listener.stops] == [
        ("step", address) for address in (1, 2, 0, 1, 3)
    ]
