from __future__ import annotations

import io

import pytest

from tmcm34x.bench import Rig, build, simple_rig
from tmcm34x.bench.description import parse
from tmcm34x.clock import HZ, MS, run_until
from tmcm34x.toolchain.assembler import assemble
from tmcm34x.trace.canvas import SvgCanvas
from tmcm34x.trace.figures import FiguresRecorder
from tmcm34x.trace.picture import PictureRecorder, draw, picture_height
from tmcm34x.trace.recorder import Trace
from tmcm34x.trace.table import TableRecorder
from tmcm34x.trace.waveform import WaveformRecorder


def started(source: str, rig: Rig | None = None) -> Rig:
    rig = rig or simple_rig(343)
    module = rig.modules[0]
    module.eeprom.write_program(assemble(source).program)
    module.program.run(0)
    return rig


def test_a_table_does_not_depend_on_slicing() -> None:
    def table(slices: list[int]) -> str:
        rig, stream = started("ROR 0, 700 \n WAIT TICKS, 0, 30 \n MST 0 \n STOP"), io.StringIO()
        trace = Trace(rig, [TableRecorder(rig, stream, 7 * MS)])
        for length in slices:
            run_until(trace, trace.now + length)
        run_until(trace, HZ)
        return stream.getvalue()

    assert table([]) == table([1, 12345, 999, 3_000_000, 17])
    assert table([]).count("\n") == 1 + 3 * (1000 // 7 + 1)


def test_a_table_tells_where_the_load_is() -> None:
    bench = '[[module]]\n[[module.axis]]\nload = {kind = "carriage", lead_mm = 8.0, start = 3.0}\n'
    rig, stream = started("MVP ABS, 0, 12800 \n STOP", build(parse(bench))), io.StringIO()
    run_until(Trace(rig, [TableRecorder(rig, stream, HZ)]), 2 * HZ)
    last = stream.getvalue().splitlines()[-3].split(",")
    assert (last[2], last[7], last[8]) == ("12800", "11", "0")


def test_a_table_needs_a_period() -> None:
    rig = simple_rig(343)
    with pytest.raises(ValueError, match="at least one clock"):
        TableRecorder(rig, io.StringIO(), 0)


def test_waveforms_do_not_depend_on_slicing() -> None:
    def waves(slices: list[int]) -> str:
        rig, stream = (
            started("ROL 2, 300 \n SIO 5, 2, 1 \n WAIT TICKS, 0, 10 \n MST 2 \n STOP"),
            io.StringIO(),
        )
        recorder = WaveformRecorder(rig, stream)
        trace = Trace(rig, [recorder])
        for length in slices:
            run_until(trace, trace.now + length)
        run_until(trace, HZ // 2)
        recorder.close()
        return "\n".join(line for line in stream.getvalue().splitlines() if "!" not in line)

    assert without_empty_times(waves([])) == without_empty_times(waves([5, 100_000, 7, 1_600_000]))


def without_empty_times(text: str) -> list[str]:
    """Times without a change say nothing."""
    lines = text.splitlines()
    return [
        line
        for line, following in zip(lines, [*lines[1:], "#"], strict=True)
        if not (line[:1] == following[:1] == "#")
    ]


def test_waveforms_are_written_in_the_order_of_time() -> None:
    rig, stream = started("ROL 0, 2047 \n ROR 1, 1500 \n Loop: JA Loop"), io.StringIO()
    run_until(Trace(rig, [WaveformRecorder(rig, stream)]), HZ // 4)
    times = [int(line[1:]) for line in stream.getvalue().splitlines() if line.startswith("#")]
    assert times == sorted(set(times))
    assert len(times) > 10_000


def test_figures_count_both_directions() -> None:
    rig = started(
        "SAP 5, 1, 50 \n MVP ABS, 1, 800 \n WAIT POS, 1, 0 \n MVP REL, 1, -300 \n WAIT POS, 1, 0 \n STOP"
    )
    recorder = FiguresRecorder(rig)
    run_until(Trace(rig, [recorder]), HZ)
    assert [(motor.distance, motor.position) for motor in recorder.figures()] == [(0, 0), (1100, 500), (0, 0)]


def test_a_picture_keeps_a_bounded_number_of_samples() -> None:
    rig = started("Loop: MVP ABS, 0, 2000 \n WAIT POS, 0, 0 \n MVP ABS, 0, 0 \n WAIT POS, 0, 0 \n JA Loop")
    recorder = PictureRecorder(rig, samples=100)
    run_until(Trace(rig, [recorder]), 20 * HZ)
    assert 50 <= len(recorder.times) <= 100
    assert recorder.times == sorted(recorder.times)
    assert recorder.moved() == (0,)
    assert max(recorder.positions[0]) <= 2000


def test_a_picture_is_drawn_whatever_happened() -> None:
    rig = started("SIO 3, 2, 1 \n STOP")
    recorder = PictureRecorder(rig)
    for _ in range(2):
        canvas = SvgCanvas(picture_height(recorder))
        draw(recorder, canvas, "a < b")
        assert "a &lt; b" in canvas.finish()
        run_until(Trace(rig, [recorder]), HZ)
    assert "outputs 00001000" in canvas.finish() or recorder.marks[0].text == "outputs 00001000"
