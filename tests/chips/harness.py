"""A chip and its definition side by side."""

from chips.oracle import HOLD, Oracle, signed24
from tmcm34x.chips.registers import BY_NAME, FIELDS, data
from tmcm34x.chips.tmc429 import Tmc429
from tmcm34x.clock import HZ

TICK = 32

FIELD_OF = {
    "x_target": "X_TARGET",
    "x": "X_ACTUAL",
    "v_min": "V_MIN",
    "v_max": "V_MAX",
    "v_target": "V_TARGET",
    "v": "V_ACTUAL",
    "a_max": "A_MAX",
    "p_mul": "PMUL",
    "p_div": "PDIV",
    "mode": "RAMP_MODE",
    "soft_stop": "SOFT_STOP",
    "disable_stop_l": "DISABLE_STOP_L",
    "disable_stop_r": "DISABLE_STOP_R",
    "ref_rnl": "REF_RNL",
    "ramp_div": "RAMP_DIV",
    "pulse_div": "PULSE_DIV",
    "usrs": "USRS",
    "tolerance": "DX_REF_TOLERANCE",
}


def set_field(chip, motor, name, value):
    """Write one field by its name, leaving the rest of its register."""
    register, field = FIELDS[name]
    word = data(chip.transfer(register.read(motor)))
    chip.transfer(register.write(field.put(word, value), motor))


def get_field(chip, motor, name):
    register, field = FIELDS[name]
    return field.get(data(chip.transfer(register.read(motor))))


def chip_with(motor=0, **values):
    """A TMC429 with these values (names as in the oracle) in the registers of one motor."""
    chip = Tmc429()
    for name, value in values.items():
        set_field(chip, motor, FIELD_OF[name], value)
    return chip


def events_until(chip, until):
    """Bring the chip to a clock; the events on the way."""
    events = []
    while (due := chip.next_event()) <= until:
        assert due > chip.now
        chip.advance(due)
        events.append(due)
    chip.advance(until)
    return events


def path(chip, motor=0, limit=100 * HZ):
    """Clock, position and velocity at each event until the chip has none."""
    places = []
    while (due := chip.next_event()) < limit:
        chip.advance(due)
        places.append((due, chip.position(motor), chip.velocity(motor)))
    return places


class Pair:
    """One motor of a chip, and the oracle; everything is done to both."""

    def __init__(self, motor=0):
        self.motor = motor
        self.chip = Tmc429()
        set_field(self.chip, motor, "EN_REFR", 1)
        self.oracle = Oracle()

    def change(self, **values):
        for name, value in values.items():
            if name == "v_target" and self.oracle.mode < 2:
                continue
            if name == "mask":
                self.chip.transfer(BY_NAME["INTERRUPTS"].write(value << 8, self.motor))
            else:
                set_field(self.chip, self.motor, FIELD_OF[name], value)
            self.oracle.change(**{name: value << 8 if name == "v" else value})

    def inputs(self, left, right):
        self.chip.set_reference_inputs((2 * left + right) << 2 * self.motor)
        self.oracle.inputs(left, right)

    def clear(self, flags):
        self.chip.transfer(BY_NAME["INTERRUPTS"].write(self.oracle.mask << 8 | flags, self.motor))
        self.oracle.flags &= ~flags

    def arm_latch(self):
        self.chip.transfer(BY_NAME["X_LATCHED"].write(0, self.motor))
        self.oracle.lp = True

    def run(self, clocks):
        """Pass time; every arrival at the target and every standstill must have been an event."""
        chip, oracle = self.chip, self.oracle
        expected = set()
        events = events_until(chip, chip.now + clocks)
        began = oracle.n
        at_target = oracle.x == oracle.x_target
        while oracle.n < chip.now // TICK:
            oracle.tick()
            if oracle.x == oracle.x_target and not at_target:
                expected.add(oracle.n * TICK)
            at_target = oracle.x == oracle.x_target
        if oracle.rest is not None and began < oracle.rest <= oracle.n - 2**oracle.ramp_div:
            expected.add(oracle.rest * TICK)
        assert expected <= set(events)
        self.compare()
        return events

    def compare(self):
        chip, oracle, motor = self.chip, self.oracle, self.motor
        state = chip.state(motor)
        assert (state.n, state.v, state.x, state.acc) == (oracle.n, oracle.v, oracle.x, oracle.acc), oracle
        assert (state.a, state.stopping) == (oracle.a, oracle.stopping), oracle
        if oracle.v == 0:
            assert state.rest == oracle.rest, oracle
        word = {name: data(chip.transfer(BY_NAME[name].read(motor))) for name in READ_BACK}
        assert word["X_ACTUAL"] == oracle.x % 2**24
        assert word["V_ACTUAL"] == oracle.v_actual() % 2**12
        assert word["V_TARGET"] == oracle.v_target_read() % 2**12, oracle
        assert word["A_ACTUAL"] == oracle.a % 2**12
        assert word["USTEP_COUNT"] == oracle.wave == chip.phase(motor)
        assert word["INTERRUPTS"] == oracle.mask << 8 | oracle.flags, oracle
        assert word["X_LATCHED"] == oracle.latched % 2**24
        assert word["REF_CONF_RAMP_MODE"] >> 16 == oracle.lp
        status = chip.read_status()
        assert bool(status & 1 << 2 * motor) == (oracle.x == oracle.x_target)
        assert bool(status & 2 << 2 * motor) == oracle.left
        assert bool(status & 0x80) == (oracle.flags != 0)


READ_BACK = (
    "X_ACTUAL",
    "V_ACTUAL",
    "V_TARGET",
    "A_ACTUAL",
    "USTEP_COUNT",
    "INTERRUPTS",
    "X_LATCHED",
    "REF_CONF_RAMP_MODE",
)

__all__ = ["HOLD", "TICK", "Pair", "chip_with", "events_until", "get_field", "path", "set_field", "signed24"]
