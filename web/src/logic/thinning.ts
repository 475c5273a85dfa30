// Long spans of a plot: each column of pixels keeps the least and the greatest value, and gaps.
import type { Value } from "./samples";

/** Points that a column of pixels keeps of a curve: least, greatest, and a gap. */
export const KEPT = 3;

/** Where columns of the width `step` begin in rising `times`, and the end; they lie at whole multiples of it, so that
 * they stay where they are while time goes on. */
export function columnsOf(times: readonly number[], step: number): number[] {
    const starts: number[] = [];
    let column = NaN;
    times.forEach((time, at) => {
        const its = Math.floor(time / step);
        if (its !== column) starts.push(at);
        column = its;
    });
    return [...starts, times.length];
}

/** The times of the points that are kept of each column. */
export function thinnedTimes(times: readonly number[], starts: readonly number[]): number[] {
    const result: number[] = [];
    for (let n = 0; n + 1 < starts.length; n++) {
        const [first, last] = [times[starts[n]!]!, times[starts[n + 1]! - 1]!];
        for (let point = 0; point < KEPT; point++) result.push(first + ((last - first) * point) / (KEPT - 1));
    }
    return result;
}

/** Least and greatest value of each column and a gap, in the order in which they came. */
export function thinned(values: readonly Value[], starts: readonly number[]): Value[] {
    const result: Value[] = [];
    for (let n = 0; n + 1 < starts.length; n++) {
        let [least, greatest, gap] = [-1, -1, -1];
        for (let at = starts[n]!; at < starts[n + 1]!; at++) {
            const value = values[at];
            if (value === undefined) continue;
            if (value === null) {
                gap = at;
                continue;
            }
            if (least < 0 || value < values[least]!) least = at;
            if (greatest < 0 || value >= values[greatest]!) greatest = at;
        }
        const kept = [...new Set([least, greatest, gap])].filter(at => at >= 0).sort((a, b) => a - b);
        for (let point = 0; point < KEPT; point++) result.push(values[kept[point] ?? -1]);
    }
    return result;
}
