import assert from "node:assert/strict";
import { test } from "node:test";
import { KEPT, columnsOf, thinned, thinnedTimes } from "../src/logic/thinning";

const TIMES = Array.from({ length: 1000 }, (_, n) => n / 100);

test("columns lie at whole multiples of their width, wherever the span begins", () => {
    assert.deepEqual(columnsOf([0.9, 1.0, 1.5, 2.0, 2.4, 4.1], 1), [0, 1, 3, 5, 6]);
    const whole = columnsOf(TIMES, 0.5).map(at => TIMES[at]);
    const later = columnsOf(TIMES.slice(130), 0.5).map(at => TIMES.slice(130)[at]);
    assert.deepEqual(later.slice(1), whole.slice(3));
});

test("a peak of one sample stays, up and down", () => {
    const values = TIMES.map((_, n) => (n === 333 ? 50 : n === 777 ? -70 : 1));
    const kept = thinned(values, columnsOf(TIMES, 0.5));
    assert.equal(kept.length, 20 * KEPT);
    assert.equal(Math.max(...kept.map(value => value ?? 0)), 50);
    assert.equal(Math.min(...kept.map(value => value ?? 0)), -70);
});

test("points of a column stand in the order in which they came, with as many times", () => {
    const starts = columnsOf([0, 0.1, 0.2, 0.3], 1);
    assert.deepEqual(thinned([1, 9, 2, 3], starts), [1, 9, undefined]);
    assert.deepEqual(thinned([9, 1, 2, 3], starts), [9, 1, undefined]);
    assert.deepEqual(thinnedTimes([0, 0.1, 0.2, 0.4], starts), [0, 0.2, 0.4]);
});

test("a gap stays a gap, and what was not looked at is none", () => {
    const starts = columnsOf([0, 0.1, 0.2, 0.3], 1);
    assert.deepEqual(thinned([1, undefined, null, undefined], starts), [1, null, undefined]);
    assert.deepEqual(thinned([null, 4, 3, 5], starts), [null, 3, 5]);
    assert.deepEqual(thinned([undefined, undefined, undefined, undefined], starts), [undefined, undefined, undefined]);
    assert.deepEqual(thinned([2, 2, 2, 2], starts), [2, 2, undefined]);
});
