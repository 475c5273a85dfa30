import assert from "node:assert/strict";
import { test } from "node:test";
import { toCsv, toVcd } from "../src/logic/export";
import { HOLE, Samples } from "../src/logic/samples";

function filled(count: number, capacity: number): Samples {
    const samples = new Samples(2, capacity);
    for (let n = 0; n < count; n++) samples.add([n / 10, n]);
    return samples;
}

test("a ring keeps the newest samples and no more", () => {
    const samples = filled(25, 10);
    assert.equal(samples.length, 10);
    assert.equal(samples.time(0), 1.5);
    assert.equal(samples.value(1, 9), 24);
});

test("a sample is found by its time", () => {
    const samples = filled(25, 10);
    assert.equal(samples.find(-1), 0);
    assert.equal(samples.find(1.85), 4);
    assert.equal(samples.find(99), 10);
});

test("where time goes back, what came after that has not happened", () => {
    const samples = filled(5, 10);
    samples.mark({ time: 0.02, text: "run", motor: -1, kind: "program" });
    samples.mark({ time: 0.3, text: "stop", motor: -1, kind: "program" });
    samples.add([0.05, 7]);
    assert.equal(samples.length, 2);
    assert.equal(samples.value(1, 1), 7);
    assert.deepEqual(
        samples.marks.map(({ text }) => text),
        ["run"],
    );
    samples.add([-1, 8]);
    assert.equal(samples.length, 1);
});

test("what was not looked at is no gap, and what was unknown is one", () => {
    const samples = new Samples(2, 5);
    for (const [time, value] of [
        [0, 7],
        [1, HOLE],
        [2, NaN],
        [3, HOLE],
        [4, 9],
    ])
        samples.add([time!, value!]);
    assert.deepEqual(samples.slice(1, 0, 5), [7, undefined, null, undefined, 9]);
    assert.equal(samples.lastValue(1, 1), 7);
    assert.ok(Number.isNaN(samples.lastValue(1, 3)));
});

test("marks are forgotten before they are too many", () => {
    const samples = new Samples(1, 5);
    for (let n = 0; n < 5000; n++) samples.mark({ time: n, text: "x", motor: -1, kind: "program" });
    assert.ok(samples.marks.length <= 500);
    assert.equal(samples.marks.at(-1)!.time, 4999);
});

test("a CSV table has a heading and a line a sample, empty where there is no value", () => {
    const samples = new Samples(3, 5);
    samples.add([0.5, 1, NaN]);
    assert.equal(
        toCsv(samples, [
            { title: "position 0", column: 1 },
            { title: 'odd, "name"', column: 2 },
        ]),
        'time_s,position_0,"odd,_""name"""\n0.500000,1,\n',
    );
});

test("a VCD file names its curves and tells changes only, negative numbers in two's complement", () => {
    const samples = new Samples(2, 5);
    samples.add([0, 1]);
    samples.add([0.001, 1]);
    samples.add([0.002, -1]);
    samples.mark({ time: 0.0015, text: "left closed", motor: 0, kind: "switch" });
    const lines = toVcd(samples, [{ title: "speed 0", column: 1 }]).split("\n");
    assert.ok(lines.includes("$timescale 1us $end"));
    assert.ok(lines.includes("$var integer 32 ! speed_0 $end"));
    assert.deepEqual(lines.slice(lines.indexOf("$enddefinitions $end") + 1), [
        "#0",
        "b1 !",
        "#1500",
        'sleft_closed "',
        "#2000",
        `b${"1".repeat(32)} !`,
        "",
    ]);
});

test("columns are arranged anew with their past", () => {
    const samples = new Samples(4, 10);
    samples.add([0, 1, 2, 3]);
    samples.arrange(1, [1, -1, 0]);
    assert.deepEqual(
        [1, 2, 3].map(column => samples.value(column, 0)),
        [2, NaN, 1],
    );
});
