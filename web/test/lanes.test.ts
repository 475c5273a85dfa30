import assert from "node:assert/strict";
import { test } from "node:test";
import { difference, labels, laneRange, slope, spanWith, ticks, zoomed } from "../src/logic/lanes";

test("a curve fills its lane and nothing else", () => {
    const [min, max] = laneRange(0, 10, 1, 3);
    const part = (value: number) => (max - value) / (max - min);
    assert.ok(Math.abs(part(10) - 1 / 3) < 1e-12);
    assert.ok(Math.abs(part(0) - 2 / 3) < 1e-12);
    assert.deepEqual(laneRange(-5, 5, 0, 1), [-5, 5]);
});

test("ticks are round, within the range, and keep their sign", () => {
    assert.deepEqual(ticks(-1000, 1000, 4), [-1000, -500, 0, 500, 1000]);
    assert.deepEqual(ticks(0.1, 0.35, 3), [0.1, 0.2, 0.3]);
    assert.deepEqual(ticks(3, 3, 4), []);
});

test("a span goes where a moment is, keeps its length, and stays where it has it", () => {
    assert.deepEqual(spanWith({ min: 10, max: 20 }, 12), { min: 10, max: 20 });
    assert.deepEqual(spanWith({ min: 10, max: 20 }, 20), { min: 10, max: 20 });
    assert.deepEqual(spanWith({ min: 90, max: 100 }, 42), { min: 37, max: 47 });
    assert.deepEqual(spanWith({ min: 10, max: 20 }, 26), { min: 21, max: 31 });
    assert.deepEqual(spanWith({ min: 90, max: 100 }, 3), { min: 0, max: 10 });
});

test("a zoom keeps what is under the pointer", () => {
    assert.deepEqual(zoomed([0, 10], 2, 0.5), [1, 6]);
});

test("a difference is taken where both are known, and a gap stays a gap", () => {
    assert.deepEqual(difference([5, undefined, null, 8], [undefined, 2, 2, 3]), [undefined, 3, null, 5]);
});

test("a slope needs two neighbours without a gap between them", () => {
    assert.deepEqual(slope([0, 1, 2, 3, 4, 5], [0, 10, undefined, 30, null, 50]), [
        null,
        10,
        undefined,
        10,
        null,
        null,
    ]);
});

test("a low lane has two labels where they fit, and none at its ends", () => {
    assert.deepEqual(labels(-45000, 55000, 2, 4, 0.1), [-20000, 0, 20000, 40000]);
    assert.deepEqual(labels(-700, 700, 2, 3, 0.1), [-500, 0, 500]);
    assert.deepEqual(labels(-700, 700, 2, 1, 0.1), [0]);
    assert.deepEqual(labels(-5, 1210, 3, 9, 0.01), [500, 1000]);
});
