"""Samples for plots, taken where the module is and stamped with its time; nothing is invented between them.

A row has a time and, of each column, one of three things: a value, that it is unknown, or that it was not looked at.
Of a virtual module all columns are read every `PERIOD` clocks of virtual time, whatever the pace; of a real one
each reading is a row of its own, at the time when its reply came.

Binary messages to pages begin with a 0 byte; then for each row: time [clocks] as a double, the columns that
were looked at and those of them that are known as two 64-bit masks, and a signed 32-bit value for each column that was
looked at, lowest first; all little-endian.
"""

from __future__ import annotations

import struct
from collections import deque
from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Final, NamedTuple, Protocol

from tmcm34x import clock
from tmcm34x.clock import TimedBench
from tmcm34x.ide import wire
from tmcm34x.tmcl.commands import MOTORS

if TYPE_CHECKING:
    from tmcm34x.host.polling import Polled

PERIOD: Final = clock.HZ // 50
"""Between two rows of a virtual module [clocks]."""
MOST: Final = 125
"""Rows of one leap of virtual time at most; also those on a way that nothing paces, after which they are twice as
far apart."""
BEHIND: Final = 1000
"""Rows without having caught up with the pace, after which they are twice as far apart."""
TOGETHER: Final = 8
"""Rows that are taken without a pause in which lines and pages are looked at."""
KEPT: Final = 4096
"""Rows that wait for pages."""
CURVES: Final = wire.CURVES
BASE: Final = MOTORS * len(CURVES) + 2
"""Columns before the watched parameters: the motors' curves, the program counter, the outputs."""
COUNTER: Final = BASE - 2
OUTPUTS: Final = BASE - 1
_HEAD: Final = struct.Struct("<dQQ")

_OTHERS: Final = {"counter": COUNTER, "outputs": OUTPUTS}
_CURVES: Final = {
    (curve.key, motor): motor * len(CURVES) + index
    for motor in range(MOTORS)
    for index, curve in enumerate(CURVES)
    if curve.key
}

Value = int | None
"""None is unknown."""


def column_of(polled: Polled) -> int | None:
    """The column of a polled value, None where it has none."""
    return _OTHERS.get(polled.key) if polled.key in _OTHERS else _CURVES.get((polled.key, polled.motor))


class Row(NamedTuple):
    """One sample; a column that is missing in `values` was not looked at."""

    number: int
    when: float
    values: Mapping[int, Value]
    watched: Mapping[wire.Watched, Value]


class Samples:
    """The newest rows, numbered from 1."""

    def __init__(self) -> None:
        self._rows: deque[Row] = deque(maxlen=KEPT)
        self.last = 0

    def add(
        self, when: float, values: Mapping[int, Value], watched: Mapping[wire.Watched, Value] | None = None
    ) -> None:
        """Have a row."""
        self.last += 1
        self._rows.append(Row(self.last, when, values, watched or {}))

    def gap(self, when: float, watches: Sequence[wire.Watched]) -> None:
        """From now on nothing is known."""
        self.add(when, dict.fromkeys(range(BASE)), dict.fromkeys(watches))

    def since(self, number: int, watches: Sequence[wire.Watched]) -> bytes:
        """The message with all rows after `number`, for a page that watches these parameters; empty for none."""
        rows = [row for row in self._rows if row.number > number] if number < self.last else []
        packed = b"".join(_pack(row, watches) for row in rows)
        return b"\0" + packed if packed else b""


def _pack(row: Row, watches: Sequence[wire.Watched]) -> bytes:
    values = dict(row.values)
    values |= {BASE + at: row.watched[item] for at, item in enumerate(watches) if item in row.watched}
    columns = sorted(values)
    if not columns:
        return b""
    looked = sum(1 << at for at in columns)
    known = sum(1 << at for at in columns if values[at] is not None)
    numbers = struct.pack(f"<{len(columns)}i", *(values[at] or 0 for at in columns))
    return _HEAD.pack(row.when, looked, known) + numbers


class SampledBench(TimedBench, Protocol):
    """What is sampled: a bench, or the history of one."""

    @property
    def now(self) -> int:
        """Its clock."""
        ...


class Sampled:
    """A bench as a part, with `take` called every `PERIOD` while time passes and `wanted` says so.

    A way to the bench's next event is parted, so that whoever advances time can do something else after every few
    rows.  Where nothing paces time, a bench without events gets none by this: taking samples does not advance time.
    """

    def __init__(
        self,
        bench: SampledBench,
        take: Callable[[], None],
        wanted: Callable[[], bool],
        paced: Callable[[], bool],
    ) -> None:
        self._rig = bench
        self._take = take
        self._wanted = wanted
        self._paced = paced
        self._due = 0
        self._resumed = True
        """No row was taken since samples are wanted again."""
        self._part = -1
        """Where the present part of a way ends."""
        self._rows = 0
        """Rows since an event, or since time was where its pace wants it."""

    @property
    def now(self) -> int:
        """The bench's clock."""
        return self._rig.now

    def begin_anew(self) -> None:
        """The bench was brought to another clock."""
        self._due = self._rig.now

    def resume(self) -> None:
        """Samples are wanted again: what has passed meanwhile is taken in one leap."""
        self._resumed = True

    def next_event(self) -> int:
        """The rig's, or a part of the way there."""
        when, self._part = self._rig.next_event(), -1
        if self._resumed or not self._wanted() or (when == clock.NEVER and not self._paced()):
            return when
        part = max(self._due, self._rig.now) + (TOGETHER - 1) * self._period
        if part < when:
            self._part = when = part
        return when

    def advance(self, now: int) -> None:
        """Bring the rig to `now`, at most to its next event, and take the samples on the way."""
        if now == self._part:
            self._go(now, self._rig.pass_to)
        else:
            self._go(now, self._rig.advance)
            self._rows = 0

    def pass_to(self, now: int) -> None:
        """The same, before its next event."""
        self._go(now, self._rig.pass_to)
        self._rows = 0

    def _go(self, now: int, bring: Callable[[int], None]) -> None:
        if not self._wanted():
            self._due = now - now % PERIOD
        elif now >= self._due:
            self._sample(now, bring)
            self._resumed = False
        bring(now)

    @property
    def _period(self) -> int:
        """Between two rows: longer and longer where time does not come up to its pace, or has none."""
        return PERIOD << self._rows // (BEHIND if self._paced() else MOST)

    def _sample(self, now: int, bring: Callable[[int], None]) -> None:
        period = max(self._period, PERIOD * -(-(now - self._due) // (MOST * PERIOD)))
        self._due = max(self._due, self._rig.now)
        while self._due <= now:
            (bring if self._due == now else self._rig.pass_to)(self._due)
            self._take()
            self._rows += 1
            self._due += period - self._due % period
