import assert from "node:assert/strict";
import { test } from "node:test";
import { Trail, type Pair, type State } from "../src/logic/trail";

const UNITS: Pair = [0.01, 0.02];
/** A state of a machine that stands at `zero` when the module counts 0. */
const state = (time: number, positions: Pair, zero: Pair = [60, 40]): State => ({
    time,
    positions,
    units: UNITS,
    places: [zero[0] + positions[0] * UNITS[0], zero[1] + positions[1] * UNITS[1]],
});
const drawn = (trail: Trail, time = Infinity) =>
    [...trail.until(time)].map(([x, y]) => (Number.isNaN(x) ? null : [+x.toFixed(6), +y.toFixed(6)]));

test("samples between two states are where the module counts them", () => {
    const trail = new Trail();
    trail.add(state(0, [0, 0]), []);
    trail.add(state(1, [1000, 0]), [
        { time: 0, positions: [0, 0] },
        { time: 0.5, positions: [700, 100] },
        { time: 1, positions: [1000, 0] },
    ]);
    assert.deepEqual(drawn(trail), [
        [60, 40],
        [67, 42],
        [70, 40],
    ]);
});

test("samples are left out where the module has begun to count from elsewhere", () => {
    const trail = new Trail();
    trail.add(state(0, [500, 0]), []);
    trail.add(state(1, [0, 0], [65, 40]), [{ time: 0.5, positions: [0, 0] }]);
    assert.deepEqual(drawn(trail), [[65, 40]]);
});

test("a past moment shows what was travelled until then", () => {
    const trail = new Trail();
    for (let n = 0; n < 5; n++) trail.add(state(n, [n * 100, 0]), []);
    assert.equal(drawn(trail, 2.5).length, 3);
    assert.equal(drawn(trail).length, 5);
});

test("a time that falls begins another course from there, after a gap", () => {
    const trail = new Trail();
    for (let n = 0; n < 5; n++) trail.add(state(n, [n * 100, 0]), []);
    trail.add(state(2, [200, 0]), []);
    trail.add(state(3, [200, 100]), []);
    assert.deepEqual(drawn(trail), [[60, 40], [61, 40], [62, 40], null, [62, 40], [62, 42]]);
});

test("a machine at rest adds nothing, and a long path forgets its oldest part", () => {
    const trail = new Trail(100);
    trail.add(state(0, [0, 0]), []);
    trail.add(state(0, [0, 0]), []);
    assert.equal(drawn(trail).length, 1);
    for (let n = 1; n < 1000; n++) trail.add(state(n, [n, n]), []);
    const points = drawn(trail);
    assert.ok(points.length <= 100 && points.length > 50);
    assert.deepEqual(points.at(-1), [69.99, 59.98]);
});
