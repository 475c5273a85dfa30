"""Modules in this process for tests of the host library: with faults on the line, in virtual time."""

from tmcm34x.bench import simple_rig
from tmcm34x.bench.in_process import RigLine
from tmcm34x.host import Connection
from tmcm34x.links.faulty import Faults
from tmcm34x.tmcl.datagram import Instruction

PROGRAM = (*(Instruction(9, n % 56, 2, n * 7919) for n in range(40)), Instruction(28))


def faulty(*texts, seed=0):
    """Faults by their texts: `garble,probability=0.05`."""
    faults = Faults(seed=seed)
    for text in texts:
        faults.add(text)
    return faults


def connected(rig=None, *, faults=None, address=1, baud=9600, retries=2, timeout_s=1.0):
    """A connection to a rig, a new TMCM-343 by default; `connection.line.rig` is the rig."""
    line = RigLine(rig or simple_rig(343), baud, faults=faults)
    return Connection(line, address=address, retries=retries, timeout_s=timeout_s)


def module_of(connection):
    """The firmware at the other end."""
    return connection.line.rig.modules[0]
