import assert from "node:assert/strict";
import { test } from "node:test";
import {
    arc,
    contacts,
    counted,
    labels,
    line,
    onCircle,
    perMicrostep,
    plan,
    rounded,
    scale,
    slats,
    span,
} from "../src/logic/machine";
import type { AxisWorld } from "../src/wire";

const rail: AxisWorld = {
    motor: "1000 mA, 0.4 Nm",
    load: 0,
    faults: [],
    left_held: false,
    right_held: false,
    unit: "mm",
    turn: 5,
    fullsteps: 200,
    low: -2,
    high: 202,
    cams: [
        { side: "left", low: null, high: 0 },
        { side: "right", low: 200, high: null },
    ],
    name: "X",
    shape: "rail",
};
const open: AxisWorld = { ...rail, low: null, high: null };
const near = (a: number, b: number) => assert.ok(Math.abs(a - b) < 1e-9, `${a} is not ${b}`);

test("a rail shows what is between its hard stops, wherever the load is", () => {
    assert.deepEqual(span(rail, 60), { low: -2, high: 202 });
    assert.deepEqual(span(rail, 500), { low: -2, high: 202 });
});

test("a rail without hard stops shows its switches and its load, in whole steps", () => {
    assert.deepEqual(span(open, 60), { low: -50, high: 250 });
    assert.deepEqual(span(open, 61), span(open, 60));
    const far = span(open, 1234.5);
    assert.ok(far.low < 0 && far.high > 1234.5 && far.high % 500 === 0);
    const bare = span({ ...open, cams: [] }, 0);
    assert.ok(bare.low < 0 && bare.high > 0 && bare.high - bare.low >= 5);
});

test("steps are 1, 2 or 5 times a power of ten, and never too small", () => {
    for (const [size, step] of [
        [0.3, 0.5],
        [1, 1],
        [1.1, 2],
        [5, 5],
        [7, 10],
        [51, 100],
        [2000, 2000],
    ] as const)
        near(rounded(size), step);
});

test("a scale takes the ends to the ends", () => {
    const x = scale({ low: -2, high: 202 }, 20, 380);
    near(x(-2), 20);
    near(x(202), 380);
    near(x(100), 200);
    const y = scale({ low: 0, high: 10 }, 100, 0);
    near(y(2.5), 75);
});

test("an end switch is pressed from its position on, and a reference switch around its middle", () => {
    const shown = span(rail, 0);
    assert.deepEqual(contacts(rail, shown), [
        { side: "left", pressed: { low: -2, high: 0 }, lever: 0 },
        { side: "right", pressed: { low: 200, high: 202 }, lever: 200 },
    ]);
    const table = { ...open, cams: [{ side: "left" as const, low: 87, high: 93 }] };
    assert.deepEqual(contacts(table, { low: 0, high: 360 }), [
        { side: "left", pressed: { low: 87, high: 93 }, lever: 90 },
    ]);
});

test("labels are round and within what is shown", () => {
    assert.deepEqual(labels({ low: -2, high: 202 }, 4), [0, 50, 100, 150, 200]);
});

test("lost steps put the load beside where the module counts it", () => {
    near(counted(rail, 50, 0), 50);
    near(counted(rail, 50, -40), 51);
    near(counted({ ...rail, turn: -5 }, 50, 40), 49);
});

test("a table's circle begins at the top and goes clockwise", () => {
    const [x, y] = onCircle(10, 90);
    near(x, 10);
    near(y, 0);
    assert.equal(arc(10, { low: 0, high: 90 }), "M0.00 -10.00A10 10 0 0 1 10.00 -0.00");
    assert.match(arc(10, { low: 0, high: 270 }), /0 1 1/);
});

test("a belt's slats move on with the load and stay on the belt", () => {
    assert.deepEqual(slats(0, 10, 2, 100, 160), [100, 120, 140]);
    assert.deepEqual(slats(2.5, 10, 2, 100, 160), [105, 125, 145]);
    assert.deepEqual(slats(-2.5, 10, 2, 100, 160), [115, 135, 155]);
    assert.deepEqual(slats(1e9, 10, 2, 100, 160), slats(0, 10, 2, 100, 160));
});

test("a plan view has one scale both ways and fits its room", () => {
    const wide = plan({ low: 0, high: 200 }, { low: 0, high: 100 }, 300, 300);
    assert.deepEqual([wide.width, wide.height], [300, 150]);
    const tall = plan({ low: 0, high: 100 }, { low: 0, high: 200 }, 300, 300);
    assert.deepEqual([tall.width, tall.height], [150, 300]);
});

test("a path has a gap where a point is unknown", () => {
    assert.equal(
        line([
            [0, 0],
            [1, 2],
            [NaN, NaN],
            [3, 4],
            [5, 6],
        ]),
        "M0.0 0.0L1.0 2.0M3.0 4.0L5.0 6.0",
    );
    assert.equal(line([]), "");
});

test("a microstep is a part of a turn's way", () => {
    near(perMicrostep(rail, 4), 5 / 3200);
    near(perMicrostep({ ...rail, turn: -5 }, 0), -0.025);
});
