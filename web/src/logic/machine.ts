// The geometry of the machine's drawing: what the bench describes and where its loads are becomes lines and places.
// Nothing here knows the page or the present time, so a past state is drawn like the present one.
import type { AxisWorld } from "../wire";
import { ticks } from "./lanes";

export type Side = "left" | "right";

/** Positions of the load, in the axis's unit. */
export interface Span {
    low: number;
    high: number;
}

/** A switch in the drawing: where it is pressed, and where its lever stands. */
export interface Contact {
    side: Side;
    pressed: Span;
    lever: number;
}

const STEPS = [1, 2, 5, 10];

/** The next of 1, 2, 5, 10, 20, ... at or above `size`. */
export function rounded(size: number): number {
    const power = 10 ** Math.floor(Math.log10(size));
    return power * STEPS.find(step => step * power >= size * (1 - 1e-9))!;
}

/** Where the switches of an axis begin and end, without those sides that have no end. */
const edges = (axis: AxisWorld): number[] =>
    axis.cams.flatMap(cam => [cam.low, cam.high]).filter(edge => edge !== null);

/** What a rail shows: from hard stop to hard stop; where there is none, past the switches and the load in whole steps. */
export function span(axis: AxisWorld, place: number): Span {
    const known = [axis.low, axis.high, ...edges(axis)].filter(edge => edge !== null);
    const low = Math.min(...known, place);
    const high = Math.max(...known, place);
    const step = rounded(Math.max(high - low, 4 * Math.abs(axis.turn)) / 4);
    return {
        low: axis.low ?? Math.floor(low / step - 0.25) * step,
        high: axis.high ?? Math.ceil(high / step + 0.25) * step,
    };
}

/** Places in the drawing of positions: `from` is that of the lowest, `to` that of the highest. */
export const scale =
    (shown: Span, from: number, to: number) =>
    (position: number): number =>
        from + ((position - shown.low) / (shown.high - shown.low)) * (to - from);

/** The switches of an axis within what is shown. */
export function contacts(axis: AxisWorld, shown: Span): Contact[] {
    return axis.cams.map(cam => {
        const pressed = { low: cam.low ?? shown.low, high: cam.high ?? shown.high };
        const lever = cam.low === null ? cam.high! : cam.high === null ? cam.low : (cam.low + cam.high) / 2;
        return { side: cam.side, pressed, lever };
    });
}

/** Round positions to label, about `wish` of them. */
export const labels = (shown: Span, wish: number): number[] => ticks(shown.low, shown.high, wish);

/** Where the module counts the load: beside it where full steps were lost. */
export const counted = (axis: AxisWorld, place: number, slip: number): number =>
    place - (slip * Math.abs(axis.turn)) / axis.fullsteps;

/** The point of a circle around 0, 0 at so many degrees, clockwise from the top. */
export function onCircle(radius: number, degrees: number): [number, number] {
    const angle = (degrees / 180) * Math.PI;
    return [radius * Math.sin(angle), -radius * Math.cos(angle)];
}

const pair = ([x, y]: [number, number]): string => `${x.toFixed(2)} ${y.toFixed(2)}`;

/** An arc of a circle around 0, 0, clockwise. */
export function arc(radius: number, { low, high }: Span): string {
    const large = high - low > 180 ? 1 : 0;
    return `M${pair(onCircle(radius, low))}A${radius} ${radius} 0 ${large} 1 ${pair(onCircle(radius, high))}`;
}

/** The marks on a moving belt: places from `from` to `to` that move on with the load, `pitch` positions apart. */
export function slats(place: number, pitch: number, perPosition: number, from: number, to: number): number[] {
    const apart = pitch * perPosition;
    const first = from + ((((place * perPosition) % apart) + apart) % apart);
    return Array.from({ length: Math.max(0, Math.ceil((to - first) / apart)) }, (_, n) => first + n * apart);
}

/** A plan view of two carriages: what it shows, in the same scale both ways, within `width` and `height`. */
export interface Plan {
    x: Span;
    y: Span;
    width: number;
    height: number;
}

export function plan(x: Span, y: Span, width: number, height: number): Plan {
    const perPosition = Math.min(width / (x.high - x.low), height / (y.high - y.low));
    return { x, y, width: (x.high - x.low) * perPosition, height: (y.high - y.low) * perPosition };
}

/** A path through points; a gap where one of them is unknown. */
export function line(points: Iterable<readonly [number, number]>): string {
    let pen = "M";
    let path = "";
    for (const [x, y] of points) {
        if (Number.isNaN(x + y)) pen = "M";
        else {
            path += `${pen}${x.toFixed(1)} ${y.toFixed(1)}`;
            pen = "L";
        }
    }
    return path;
}

/** Positions of a microstep on an axis whose microstep resolution (axis parameter 140) is `resolution`. */
export const perMicrostep = (axis: AxisWorld, resolution: number): number =>
    axis.turn / (axis.fullsteps * 2 ** resolution);
