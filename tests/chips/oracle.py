"""What one axis of the TMC428/429 does, tick by tick: the specification of `tmcm34x.chips.ramp`.

A tick is 32 clocks.  The velocity `v` is signed, in 1/256 of a velocity unit; `acc` is the pulse generator's
accumulator of 11 bits.  Plain on purpose: no cleverness may hide in here.
"""

from dataclasses import dataclass
from math import isqrt

RAMP, SOFT, VELOCITY, HOLD = range(4)
POS_END, REF_WRONG, REF_MISS, STOP = 1, 2, 4, 8
LEFT_LOW, RIGHT_LOW, LEFT_HIGH, RIGHT_HIGH = 16, 32, 64, 128


def signed24(x):
    return (x + 2**23) % 2**24 - 2**23


def sign(value):
    return (value > 0) - (value < 0)


def moved_toward(v, target, step):
    return min(v + step, target) if v < target else max(v - step, target)


@dataclass
class Oracle:
    mode: int = RAMP
    x_target: int = 0
    x: int = 0
    v_min: int = 0
    v_max: int = 0
    v_target: int = 0
    v: int = 0
    a_max: int = 0
    p_mul: int = 128
    p_div: int = 0
    ramp_div: int = 0
    pulse_div: int = 0
    usrs: int = 0
    soft_stop: int = 0
    disable_stop_l: int = 0
    disable_stop_r: int = 0
    ref_rnl: int = 0
    tolerance: int = 0
    mask: int = 0
    left: bool = False
    right: bool = False

    n: int = 0
    """Ticks since power-on."""
    acc: int = 0
    wave: int = 0
    a: int = 0
    """A_ACTUAL: what the last ramp tick did to the velocity."""
    stopping: bool = False
    """Whether the last ramp tick took speed away because of a stop switch."""
    rest: int | None = 0
    """Tick since which v is zero."""
    flags: int = 0
    lp: bool = False
    latched: int = 0

    # ---- a tick

    def tick(self):
        before = self.conditions()
        self.n += 1
        if self.n % 2**self.ramp_div == 0:
            self.ramp_tick()
        if self.n % 2**self.pulse_div == 0:
            self.pulse_tick()
        self.settle(before)

    def ramp_tick(self):
        old = self.v
        if self.mode in (RAMP, SOFT) and self.distance() == 0 and abs(self.v) >> 8 <= self.v_min:
            self.v = 0
        new = moved_toward(self.v, self.velocity_aimed_at(), self.a_max)
        self.stopping = False
        if new != 0 and self.blocked(sign(new)):
            self.stopping = old != 0
            soft = self.soft_stop and self.mode != HOLD
            new = moved_toward(self.v, 0, self.a_max) if soft else 0
        self.v = new
        self.a = sign(new - old) * self.a_max

    def pulse_tick(self):
        self.acc += abs(self.v) >> 8
        if self.acc >= 2048:
            self.acc -= 2048
            self.x = signed24(self.x + sign(self.v))
            self.wave = (self.wave + sign(self.v) * (64 >> min(self.usrs, 6))) % 256

    def distance(self):
        return signed24(self.x_target - self.x)

    def velocity_aimed_at(self):
        if self.mode == HOLD:
            return self.v
        if self.mode == VELOCITY:
            return 256 * max(-self.v_max, min(self.v_max, self.v_target))
        d = self.distance()
        far = 0 if d == -(2**23) else min(abs(d), 2**19 - 1)
        return sign(d) * 256 * self.allowed(far) if far else 0

    def allowed(self, far):
        if self.mode == SOFT:
            limit = self.p_mul * far // 2 ** (3 + self.p_div)
        else:
            limit = isqrt(2048 * self.p_mul * (far - 1) // 2 ** (3 + self.p_div))
        return min(self.v_max, max(self.v_min, limit))

    def blocked(self, direction):
        if self.tolerance and abs(self.x) <= self.tolerance:
            return False
        if direction > 0:
            return self.right and not self.disable_stop_r
        return self.left and not self.disable_stop_l

    # ---- what is read

    def v_actual(self):
        return sign(self.v) * (abs(self.v) >> 8)

    def v_target_read(self):
        if self.mode in (VELOCITY, HOLD):
            return self.v_target
        falling = self.a * self.v < 0
        aimed = sign(self.v) * self.velocity_aimed_at()
        braking = aimed < 256 * self.v_max and abs(self.v) >= aimed
        return 0 if falling or braking else sign(self.v) * self.v_max

    # ---- what happens from outside

    def change(self, **values):
        before = self.conditions()
        if values.get("mode", self.mode) in (VELOCITY, HOLD):
            self.v_target = self.v_target_read()
        for name, value in values.items():
            setattr(self, name, value)
        self.settle(before)

    def inputs(self, left, right):
        before = self.conditions()
        reference = self.right if self.ref_rnl else self.left
        edges = (
            LEFT_LOW * (self.left and not left)
            | RIGHT_LOW * (self.right and not right)
            | LEFT_HIGH * (left and not self.left)
            | RIGHT_HIGH * (right and not self.right)
        )
        self.left, self.right = left, right
        if self.lp and self.v and reference != (right if self.ref_rnl else left):
            self.lp, self.latched = False, self.x
        self.flags |= edges & self.mask
        self.settle(before)

    # ---- interrupts: a flag is set when its condition becomes true

    def conditions(self):
        reference = self.right if self.ref_rnl else self.left
        return (
            POS_END * (self.x == self.x_target)
            | REF_WRONG * (reference and abs(self.x) > self.tolerance)
            | REF_MISS * (not reference and self.x == 0)
            | STOP * self.stopping
        )

    def settle(self, before):
        risen = self.conditions() & ~before & self.mask
        if self.mode not in (RAMP, SOFT):
            risen &= ~POS_END
        self.flags = (self.flags | risen) & self.mask
        if self.v:
            self.rest = None
        elif self.rest is None:
            self.rest = self.n
