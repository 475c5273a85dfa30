// Which curves a plot shows, and their values.
import type uPlot from "uplot";
import { MOTOR_CURVES, WATCH_COLUMN, columnOf, samples, tables, watches, welcome } from "../../logic/app";
import { difference, slope } from "../../logic/lanes";
import { KEPT, columnsOf, thinned, thinnedTimes } from "../../logic/thinning";
import { remembered } from "../../logic/settings";
import type { Curve } from "../../logic/export";
import type { Watched } from "../../wire";

const KINDS = [
    { curve: "position", title: "position", scale: "position" },
    { curve: "target", title: "target", scale: "position" },
    { curve: "speed", title: "speed", scale: "speed" },
    { curve: "target_speed", title: "target speed", scale: "speed" },
    { curve: "load", title: "load", scale: "load" },
    { curve: "current", title: "current", scale: "current" },
    { curve: "encoder", title: "encoder", scale: "position" },
    { curve: "acceleration", title: "acceleration", scale: "acceleration" },
    { curve: "following_error", title: "following error", scale: "following error" },
    { curve: "measured_acceleration", title: "measured acceleration", scale: "speed change" },
] as const;
/** Curves with a button of their own. */
export const FIRST: ReadonlySet<string> = new Set(["position", "target", "speed", "load"]);
const OF_DRIVERS: ReadonlySet<string> = new Set(["load", "current"]);
/** Without drivers of its own a module measures neither load nor current. */
export const offered = () => KINDS.filter(({ curve }) => welcome.value?.model.drivers || !OF_DRIVERS.has(curve));
export const SPANS = [
    [2, "2 s"],
    [10, "10 s"],
    [60, "1 min"],
    [600, "10 min"],
] as const;

export const shownKinds = remembered<string[]>("curves", ["position", "target", "speed"]);
export const shownMotors = remembered<number[]>("curve-motors", [0, 1, 2]);
export const span = remembered<number>("span", 10);
export const frozen = remembered<boolean>("frozen", false);

export const css = (name: string): string => getComputedStyle(document.documentElement).getPropertyValue(name).trim();

export const watchTitle = (watch: Watched): string =>
    `${rowOf(watch)?.name ?? watch.number}${watch.bank === -1 ? ` ${watch.motor}` : ""}`;

/** What is computed of a motor's columns. */
type Derived = "following_error" | "measured_acceleration";
export interface ShownCurve extends Curve {
    /** What it is, without the motor. */
    kind: string;
    scale: string;
    colour: string;
    dash?: number[];
    width: number;
    derived?: Derived;
    /** It jumps from one value to the next: nothing lies between. */
    set?: boolean;
    motor?: number;
}

/** Lines by kind, so that curves of one motor differ in one lane too. */
const DASHES: Record<string, number[]> = { target: [5, 4], target_speed: [5, 4], encoder: [2, 3] };
/** Lines of parameters of a motor, which share its colour with its other curves. */
const WATCH_DASHES: readonly number[][] = [
    [8, 3],
    [1, 2],
    [8, 3, 2, 3],
    [4, 2, 1, 2, 1, 2],
];
/** Lanes of parameters by their unit; what they mean is written in the lane. */
const LANES: Record<string, string> = {
    microsteps: "position",
    "velocity units": "speed",
    "acceleration units": "acceleration",
};
export const UNITS: Record<string, string> = {
    position: "microsteps",
    speed: "velocity units",
    acceleration: "acceleration units",
    "following error": "microsteps",
    "speed change": "velocity units/s",
};

/** The row of a parameter. */
const rowOf = ({ bank, number }: Watched) =>
    (bank === -1 ? tables.value.axis : tables.value.globals).find(
        item => item.number === number && (bank === -1 || item.bank === bank),
    );

/** The lane of a parameter: that of its unit. */
function laneOf(watch: Watched): string {
    const row = rowOf(watch);
    return LANES[row?.unit ?? ""] ?? (row?.unit || "value");
}

export function shownCurves(): ShownCurve[] {
    const list: ShownCurve[] = [];
    offered().forEach(({ curve, title, scale }) => {
        if (!shownKinds.value.includes(curve)) return;
        const derived = curve === "following_error" || curve === "measured_acceleration" ? curve : undefined;
        for (const motor of shownMotors.value)
            list.push({
                title: `${title} ${motor}`,
                kind: title,
                column: derived ? -1 : columnOf(motor, MOTOR_CURVES.indexOf(curve as "position")),
                scale,
                motor,
                derived,
                colour: css(`--motor${motor}`),
                dash: DASHES[curve],
                set: curve === "target",
                width: DASHES[curve] ? 1.5 : 2,
            });
    });
    watches.value.forEach((watch, at) => {
        const ofMotor = watch.bank === -1;
        list.push({
            title: watchTitle(watch),
            kind: rowOf(watch)?.name ?? String(watch.number),
            column: WATCH_COLUMN + at,
            scale: laneOf(watch),
            motor: ofMotor ? watch.motor : undefined,
            colour: css(ofMotor ? `--motor${watch.motor}` : `--watch${at % 4}`),
            width: 1.5,
            dash: ofMotor ? WATCH_DASHES[at % WATCH_DASHES.length] : at >= 4 ? [6, 2, 1, 2] : undefined,
        });
    });
    return list;
}

/** The values of a curve from one sample to another. */
export function valuesOf(curve: ShownCurve, first: number, last: number) {
    const slice = (column: number) => samples.slice(column, first, last);
    const of = (name: "position" | "encoder" | "speed") => slice(columnOf(curve.motor!, MOTOR_CURVES.indexOf(name)));
    if (curve.derived === "following_error") return difference(of("position"), of("encoder"));
    if (curve.derived === "measured_acceleration") return slope(slice(0), of("speed"));
    return slice(curve.column);
}

/** Columns that a span is thinned to at most: a curve of three points in each is as fine as a screen. */
const MOST_COLUMNS = 1200;

/** What uPlot draws between two times in a picture so many pixels wide; null is a gap. */
export function dataBetween(
    curves: readonly ShownCurve[],
    from: number,
    to: number,
    pixels: number,
): uPlot.AlignedData {
    const first = Math.max(0, samples.find(from) - 1);
    const last = Math.min(samples.length, samples.find(to) + 1);
    const columns = Math.max(1, Math.min(MOST_COLUMNS, pixels));
    const times = samples.slice(0, first, last) as number[];
    const values = curves.map(curve => valuesOf(curve, first, last));
    if (times.length <= KEPT * columns) return [times, ...values] as uPlot.AlignedData;
    const starts = columnsOf(times, (to - from) / columns);
    return [thinnedTimes(times, starts), ...values.map(each => thinned(each, starts))] as uPlot.AlignedData;
}

/** Samples that are looked at for the newest value of a computed curve. */
const RECENT = 20;

/** The newest value of a curve; NaN where it is unknown. */
export function newest(curve: ShownCurve): number {
    if (!curve.derived) return samples.lastValue(curve.column, samples.length - 1);
    const values = valuesOf(curve, Math.max(0, samples.length - RECENT), samples.length);
    return values.findLast(value => value !== undefined) ?? NaN;
}

export const toggle = <T>(list: readonly T[], item: T): T[] =>
    list.includes(item) ? list.filter(other => other !== item) : [...list, item];
