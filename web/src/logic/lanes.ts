// Lanes of a plot: one above the other on one time axis, one for each unit.
import type { Value } from "./samples";

export interface Lane {
    scale: string;
    low: number;
    high: number;
}

/** The range of a whole axis on which `low` to `high` fills lane `index` of `count`, from the top. */
export function laneRange(low: number, high: number, index: number, count: number): [number, number] {
    const size = high - low;
    return [low - (count - 1 - index) * size, high + index * size];
}

/** Round numbers between `low` and `high`, about `wish` of them. */
export function ticks(low: number, high: number, wish: number): number[] {
    const size = high - low;
    if (!(size > 0) || wish < 1) return [];
    const power = 10 ** Math.floor(Math.log10(size / wish));
    const step = [1, 2, 5, 10].map(n => n * power).find(n => size / n <= wish + 0.5) ?? 10 * power;
    const first = Math.ceil(low / step - 1e-9);
    return Array.from(
        { length: Math.floor(high / step + 1e-9) - first + 1 },
        (_, n) => +((first + n) * step).toPrecision(12),
    );
}

/** Round numbers between `low` and `high` for labels, about `wish` and `most` at most: two at least, where two fit, and
 * none in the outer `edge` part. */
export function labels(low: number, high: number, wish: number, most: number, edge: number): number[] {
    const margin = (high - low) * edge;
    const inside = (count: number) => ticks(low, high, count).filter(at => at >= low + margin && at <= high - margin);
    const lists = [0, 1, 2, 4, 8].map(more => inside(wish + more));
    return lists.find(({ length }) => length >= 2 && length <= most) ?? lists[0]!;
}

/** A lane's range made smaller or larger by `factor` around `centre`. */
export const zoomed = ([low, high]: [number, number], centre: number, factor: number): [number, number] => [
    centre - (centre - low) * factor,
    centre + (high - centre) * factor,
];

/** A span moved, where it has to be, so that `moment` is in it. */
export function spanWith(span: { min: number; max: number }, moment: number): { min: number; max: number } {
    if (moment >= span.min && moment <= span.max) return span;
    const length = span.max - span.min;
    const min = Math.max(0, moment - length / 2);
    return { min, max: min + length };
}

/** `first` less `second`, at the times when `second` was looked at. */
export function difference(first: readonly Value[], second: readonly Value[]): Value[] {
    let last: Value;
    return second.map((value, at) => {
        if (first[at] !== undefined) last = first[at];
        if (value === undefined) return undefined;
        return value === null || last == null ? null : last - value;
    });
}

/** How fast `values` change, from one that was looked at to the next. */
export function slope(times: readonly Value[], values: readonly Value[]): Value[] {
    let before: { time: number; value: number } | null = null;
    return values.map((value, at) => {
        if (value === undefined) return undefined;
        const time = times[at]!;
        const last = before;
        before = value === null ? null : { time, value };
        return value === null || !last || time <= last.time ? null : (value - last.value) / (time - last.time);
    });
}
