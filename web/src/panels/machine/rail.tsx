// A carriage on a rail, and a belt, seen from the side.
import type { JSX } from "preact";
import { motors } from "../../logic/app";
import { contacts, counted, labels, perMicrostep, rounded, scale, slats, span } from "../../logic/machine";
import type { AxisWorld } from "../../wire";
import { Contact } from "./contact";
import { type Mark, placesOf } from "./marks";

export const WIDTH = 400;
const ENDS = [26, WIDTH - 26] as const;
const RAIL = 56;
const LEVERS = 18;

interface Props {
    motor: number;
    axis: AxisWorld;
}

export function Rail({ motor, axis, marks }: Props & { marks: Mark[] }): JSX.Element {
    const { place, slip, position, resolution } = motors[motor]!.value;
    const shown = span(axis, place);
    const x = scale(shown, ...ENDS);
    const zero = place - position * perMicrostep(axis, resolution);
    const switches = contacts(axis, shown);
    return (
        <svg class="side-view" viewBox={`0 0 ${WIDTH} 92`} role="group" aria-label={`Rail of motor ${motor}`}>
            <path class="bed" d={`M${ENDS[0]} ${RAIL}H${ENDS[1]}`} />
            {axis.low !== null && <rect class="stop" x={ENDS[0] - 7} y={RAIL - 22} width="7" height="26" />}
            {axis.high !== null && <rect class="stop" x={ENDS[1]} y={RAIL - 22} width="7" height="26" />}
            {labels(shown, 6).map(at => (
                <g key={at} class="tick">
                    <path d={`M${x(at).toFixed(1)} ${RAIL + 2}v5`} />
                    <text x={x(at)} y={RAIL + 18}>
                        {at}
                    </text>
                </g>
            ))}
            {switches.map(({ side, pressed, lever }, at) => (
                <g key={`${side}${at}`}>
                    <path class="cam" d={`M${x(pressed.low).toFixed(1)} ${RAIL - 26}H${x(pressed.high).toFixed(1)}`} />
                    <path class="lead" d={`M${x(lever).toFixed(1)} ${LEVERS + 8}V${RAIL - 26}`} />
                </g>
            ))}
            {placesOf(marks, motor, zero, perMicrostep(axis, resolution)).map(mark => (
                <g key={mark.number} class="mark" transform={`translate(${x(mark.place).toFixed(1)} ${RAIL})`}>
                    <path d="M0-4 4 0 0 4-4 0Z" />
                    <text y="33">{mark.number}</text>
                </g>
            ))}
            {slip !== 0 && (
                <rect
                    class="counted"
                    x={x(counted(axis, place, slip)) - 15}
                    y={RAIL - 21}
                    width="30"
                    height="18"
                    rx="3"
                />
            )}
            <g class="carriage" transform={`translate(${x(place).toFixed(2)} ${RAIL})`}>
                <rect x="-15" y="-21" width="30" height="18" rx="3" />
                <path d="M0-18V-6" />
            </g>
            {switches.map(({ side, lever }, at) => (
                <Contact
                    key={`${side}${at}`}
                    motor={motor}
                    side={side}
                    x={x(lever)}
                    y={LEVERS}
                    reference={switches.findIndex(other => other.side === side) < at}
                />
            ))}
        </svg>
    );
}

/** Slats on the belt are so many pixels apart at least. */
const PITCH = 24;
const DRUM = 15;

export function Belt({ motor, axis }: Props): JSX.Element {
    const { place } = motors[motor]!.value;
    const pitch = rounded(Math.abs(axis.turn) / 4);
    const perPosition = PITCH / pitch;
    const [from, to] = [ENDS[0] + DRUM, ENDS[1] - DRUM];
    const degrees = ((place * perPosition) / DRUM / Math.PI) * 180;
    return (
        <svg class="side-view" viewBox={`0 0 ${WIDTH} 62`} role="img" aria-label={`Belt of motor ${motor}`}>
            <rect class="belt" x={ENDS[0]} y="12" width={ENDS[1] - ENDS[0]} height={2 * DRUM} rx={DRUM} />
            {slats(place, pitch, perPosition, from, to).map((x, at) => (
                <path key={at} class="slat" d={`M${x.toFixed(1)} 8v8`} />
            ))}
            {[from, to].map(x => (
                <g
                    key={x}
                    class="drum"
                    transform={`translate(${x} ${12 + DRUM}) rotate(${(degrees % 360).toFixed(1)})`}
                >
                    <circle r={DRUM - 4} />
                    <path d={`M0 0V${4 - DRUM}`} />
                </g>
            ))}
            <text class="note" x={WIDTH / 2} y={12 + DRUM + 4}>
                {`slats ${pitch} ${axis.unit} apart`}
            </text>
        </svg>
    );
}
