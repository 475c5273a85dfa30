// What turns: a table with its cams, and a shaft that nothing hangs on.
import type { JSX } from "preact";
import { motors } from "../../logic/app";
import { arc, contacts, counted, onCircle } from "../../logic/machine";
import type { AxisWorld } from "../../wire";
import { Contact } from "./contact";

const R = 62;
const CIRCLE = { low: 0, high: 360 };
const TWELFTHS = Array.from({ length: 12 }, (_, n) => n * 30);

interface Props {
    motor: number;
    axis: AxisWorld;
}

export function Turntable({ motor, axis }: Props): JSX.Element {
    const { place, slip } = motors[motor]!.value;
    const switches = contacts(axis, CIRCLE);
    return (
        <svg class="top-view" viewBox="-130 -100 260 200" role="group" aria-label={`Turntable of motor ${motor}`}>
            <circle class="table" r={R} />
            {TWELFTHS.map(degrees => {
                const [x, y] = onCircle(R + 14, degrees);
                return (
                    <g key={degrees} class="tick">
                        <path transform={`rotate(${degrees})`} d={`M0 ${-R}v-4`} />
                        {degrees % 90 === 0 && (
                            <text x={x} y={y + 4}>
                                {degrees}
                            </text>
                        )}
                    </g>
                );
            })}
            {switches.map(({ pressed }, at) => (
                <path key={at} class="cam" d={arc(R + 3, pressed)} />
            ))}
            {slip !== 0 && (
                <path
                    class="counted"
                    transform={`rotate(${counted(axis, place, slip).toFixed(2)})`}
                    d={`M0 0V${-R + 6}`}
                />
            )}
            <g class="carriage" transform={`rotate(${place.toFixed(2)})`}>
                <path class="pointer" d={`M0 ${-R + 4} 7 ${-R + 20}H-7Z`} />
                <path d={`M0 ${-R + 20}V0`} />
                <circle r="6" />
            </g>
            {switches.map(({ side, lever }, at) => {
                const [x, y] = onCircle(R + 42, lever);
                const reference = switches.findIndex(other => other.side === side) < at;
                return <Contact key={at} motor={motor} side={side} x={x} y={y} reference={reference} />;
            })}
        </svg>
    );
}

export function Shaft({ motor }: { motor: number }): JSX.Element {
    const degrees = (motors[motor]!.value.angle / Math.PI) * 180;
    return (
        <svg class="top-view" viewBox="-60 -44 120 88" role="img" aria-label={`Shaft of motor ${motor}`}>
            <circle class="table" r="36" />
            <g class="carriage" transform={`rotate(${(degrees % 360).toFixed(2)})`}>
                <path class="pointer" d="M0-34 6-22H-6Z" />
                <path d="M0-22V0" />
                <circle r="7" />
            </g>
        </svg>
    );
}
