// Two carriages that move one tool, seen from above, with the path that it has travelled.
import type { JSX } from "preact";
import {
    clockSeconds,
    columnOf,
    frameListeners,
    motors,
    onServerEvent,
    sampleListeners,
    time,
    world,
} from "../../logic/app";
import { TIME_FLAGS } from "../../wire";
import { contacts, labels, line, perMicrostep, plan, scale, span } from "../../logic/machine";
import { type Pair, type Sample, Trail } from "../../logic/trail";
import { Contact } from "./contact";
import type { Mark } from "./marks";

const WIDTH = 400;
const HIGHEST = 270;
const EDGE = { left: 62, right: 14, top: 10, bottom: 60 };
const POSITION = 0;
/** Samples that wait for a state of the present. */
const MOST = 4000;

export const trail = new Trail();
let samples: Sample[] = [];

// Another module, or this one anew: nothing has been travelled yet.
onServerEvent(({ event }) => {
    if (event === "welcome") trail.clear();
});

sampleListeners.add(row => {
    const plane = world.peek()?.plane;
    if (plane?.length !== 2) return;
    const positions: Pair = [row[columnOf(plane[0]!, POSITION)]!, row[columnOf(plane[1]!, POSITION)]!];
    if (Number.isFinite(positions[0] + positions[1])) samples.push({ time: row[0]!, positions });
    if (samples.length > MOST) samples.shift();
});

/** A past moment is shown: what is drawn is a part of the path that is known. */
const past = (): boolean => (time.peek().flags & TIME_FLAGS.past) !== 0;

frameListeners.add(() => {
    const shown = world.peek();
    if (shown?.plane.length !== 2 || time.peek().clock === 0 || past()) return;
    const of = (value: (motor: number) => number): Pair => [value(shown.plane[0]!), value(shown.plane[1]!)];
    trail.add(
        {
            time: clockSeconds.peek(),
            places: of(motor => motors[motor]!.peek().place),
            positions: of(motor => motors[motor]!.peek().position),
            units: of(motor => perMicrostep(shown.axes[motor]!, motors[motor]!.peek().resolution)),
        },
        samples,
    );
    samples = [];
});

export function Plane({ pair, marks }: { pair: Pair; marks: Mark[] }): JSX.Element {
    const [across, up] = pair;
    const axes = world.value!.axes;
    const [axisX, axisY] = [axes[across]!, axes[up]!];
    const [stateX, stateY] = [motors[across]!.value, motors[up]!.value];
    const [shownX, shownY] = [span(axisX, stateX.place), span(axisY, stateY.place)];
    const { width, height } = plan(shownX, shownY, WIDTH - EDGE.left - EDGE.right, HIGHEST);
    const left = EDGE.left + (WIDTH - EDGE.left - EDGE.right - width) / 2;
    const bottom = EDGE.top + height;
    const x = scale(shownX, left, left + width);
    const y = scale(shownY, bottom, EDGE.top);
    const [atX, atY] = [x(stateX.place), y(stateY.place)];
    const [unitX, unitY] = [perMicrostep(axisX, stateX.resolution), perMicrostep(axisY, stateY.resolution)];
    const zero: Pair = [stateX.place - stateX.position * unitX, stateY.place - stateY.position * unitY];
    const path = line([...trail.until(clockSeconds.value)].map(([a, b]) => [x(a), y(b)] as const));
    return (
        <svg
            class="plan-view"
            viewBox={`0 0 ${WIDTH} ${(bottom + EDGE.bottom).toFixed(0)}`}
            role="group"
            aria-label={`Plan view of motors ${across} and ${up}`}
        >
            <rect class="room" x={left} y={EDGE.top} width={width} height={height} />
            <Scale motor={across} at={x} shown={shownX} edge={bottom} />
            <Scale motor={up} at={y} shown={shownY} edge={left} upright />
            <path class="trail" d={path} />
            {marks
                .filter(({ positions }) => positions[across] !== 0 || positions[up] !== 0)
                .map(({ number, positions }) => (
                    <g
                        key={number}
                        class="mark"
                        transform={`translate(${x(zero[0] + positions[across]! * unitX).toFixed(1)} ${y(zero[1] + positions[up]! * unitY).toFixed(1)})`}
                    >
                        <path d="M0-4 4 0 0 4-4 0Z" />
                        <text x="8" y="-4">
                            {number}
                        </text>
                    </g>
                ))}
            <g class={`gantry motor${across}`} transform={`translate(${atX.toFixed(2)} 0)`}>
                <rect x="-4" y={EDGE.top} width="8" height={height} />
            </g>
            <g class={`carriage motor${up}`} transform={`translate(${atX.toFixed(2)} ${atY.toFixed(2)})`}>
                <rect x="-10" y="-8" width="20" height="16" rx="3" />
                <path d="M-5 0H5M0-5V5" />
            </g>
            <Switches motor={across} at={x} shown={shownX} edge={bottom} />
            <Switches motor={up} at={y} shown={shownY} edge={left} upright />
        </svg>
    );
}

interface Side {
    motor: number;
    at: (position: number) => number;
    shown: { low: number; high: number };
    /** Where the edge of the room is: at the bottom, or at the left of an upright axis. */
    edge: number;
    upright?: boolean;
}

function Scale({ motor, at, shown, edge, upright = false }: Side): JSX.Element {
    return (
        <g class={`motor${motor}`}>
            {labels(shown, 5).map(value => (
                <g key={value} class="tick">
                    <path
                        d={upright ? `M${edge - 5} ${at(value).toFixed(1)}h5` : `M${at(value).toFixed(1)} ${edge}v5`}
                    />
                    <text
                        class={upright ? "upright" : ""}
                        x={upright ? edge - 34 : at(value)}
                        y={upright ? at(value) + 4 : edge + 53}
                    >
                        {value}
                    </text>
                </g>
            ))}
        </g>
    );
}

function Switches({ motor, at, shown, edge, upright = false }: Side): JSX.Element {
    const switches = contacts(world.value!.axes[motor]!, shown);
    return (
        <g class={`motor${motor}`}>
            {switches.map(({ side, pressed, lever }, index) => (
                <g key={`${side}${index}`}>
                    <path
                        class="cam"
                        d={
                            upright
                                ? `M${edge - 3} ${at(pressed.low).toFixed(1)}V${at(pressed.high).toFixed(1)}`
                                : `M${at(pressed.low).toFixed(1)} ${edge + 3}H${at(pressed.high).toFixed(1)}`
                        }
                    />
                    <Contact
                        motor={motor}
                        side={side}
                        x={upright ? edge - 18 : at(lever)}
                        y={upright ? at(lever) : edge + 26}
                        reference={switches.findIndex(other => other.side === side) < index}
                    />
                </g>
            ))}
        </g>
    );
}
