// What the lines of a plot are, and what their newest values are; what the cursor reads.
import { useEffect, useRef } from "preact/hooks";
import { frameListeners } from "../../logic/app";
import { grouped } from "../../logic/units";
import type { Reading } from "./chart";
import { newest, type ShownCurve } from "./curves";

/** Milliseconds between two values, at least: as fast as a person reads. */
const PAUSE_MS = 100;

const shown = (value: number | null | undefined): string =>
    value == null || Number.isNaN(value) ? "\u2013" : grouped(value);

const Line = ({ curve }: { curve: ShownCurve }) => (
    <svg width="22" height="10" viewBox="0 0 22 10" aria-hidden="true">
        <path d="M1 5H21" stroke={curve.colour} stroke-width="2" stroke-dasharray={curve.dash?.join(" ")} />
    </svg>
);

/** The curves by what they are: a line, the motor, the newest value of each. */
export function Legend({ curves }: { curves: readonly ShownCurve[] }) {
    const values = useRef<(HTMLElement | null)[]>([]);
    useEffect(() => {
        let last = 0;
        const tell = () => {
            const now = performance.now();
            if (now - last < PAUSE_MS) return;
            last = now;
            curves.forEach((curve, at) => {
                const text = shown(newest(curve));
                const element = values.current[at];
                if (element && element.textContent !== text) element.textContent = text;
            });
        };
        tell();
        frameListeners.add(tell);
        return () => void frameListeners.delete(tell);
    }, [curves]);
    const kinds = [...new Set(curves.map(({ kind }) => kind))];
    return (
        <div class="legend" role="group" aria-label="Newest values">
            {kinds.map(kind => (
                <span class="kind" key={kind}>
                    {kind}
                    {curves.map(
                        (curve, at) =>
                            curve.kind === kind && (
                                <span key={curve.title} class="curve" title={curve.title}>
                                    <Line curve={curve} />
                                    {curve.motor !== undefined && <i style={{ color: curve.colour }}>{curve.motor}</i>}
                                    <b
                                        data-curve={curve.title}
                                        ref={element => {
                                            values.current[at] = element;
                                        }}
                                    />
                                </span>
                            ),
                    )}
                </span>
            ))}
        </div>
    );
}

/** The curves where the cursor is, and where it was pinned; their differences. */
export function Readout({
    curves,
    readings,
    left,
}: {
    curves: readonly ShownCurve[];
    readings: readonly Reading[];
    left: boolean;
}) {
    const [first, second] = readings;
    if (!first) return null;
    const difference = (n: number): number | null => {
        const [a, b] = [first.values[n], second?.values[n]];
        return a == null || b == null ? null : b - a;
    };
    return (
        <table class={`readout ${left ? "left" : ""}`}>
            <tbody>
                <tr>
                    <th>time</th>
                    <td>{first.time.toFixed(3)} s</td>
                    {second && (
                        <>
                            <td>{second.time.toFixed(3)} s</td>
                            <td>&Delta; {(second.time - first.time).toFixed(3).replace("-", "\u2212")} s</td>
                        </>
                    )}
                </tr>
                {curves.map((curve, n) => (
                    <tr key={curve.title}>
                        <th>
                            <Line curve={curve} /> {curve.title}
                        </th>
                        <td>{shown(first.values[n])}</td>
                        {second && (
                            <>
                                <td>{shown(second.values[n])}</td>
                                <td>{shown(difference(n))}</td>
                            </>
                        )}
                    </tr>
                ))}
            </tbody>
        </table>
    );
}
