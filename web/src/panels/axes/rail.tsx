// The way of an axis: position, target, and the switches that a bench has.
import { useSignal } from "@preact/signals";
import { useRef } from "preact/hooks";
import { flag, motors, world } from "../../logic/app";
import { grouped } from "../../logic/units";
import type { AxisWorld, Cam as CamPlace, MotorState } from "../../wire";
import { Sketch, type Pen } from "../../widgets/sketch";

interface Way {
    low: number;
    high: number;
}

/** A way around zero, ten times a round number wide, that is grown and shrunk in steps. */
function openWay(way: Way, far: number): Way {
    if (far <= way.high && far >= way.high / 40) return way;
    const size = 10 ** Math.floor(Math.log10(Math.max(far, 100)));
    const high = [1, 2, 5, 10, 20].map(n => n * size).find(n => n >= far * 1.15)!;
    return { low: -high, high };
}

/** How far from zero an axis without ends is, or goes. */
const farthest = ({ position, target, mode }: MotorState): number =>
    Math.max(Math.abs(position), mode === 0 ? Math.abs(target) : 0);

/** The way between the ends of a machine in microsteps; null where it has none.  `offset` is kept from one look to the next. */
function machineWay(motor: number, state: MotorState, offset: { current: number }): Way | null {
    const machine = world.value?.axes[motor];
    const ends = machine && machineEnds(machine);
    if (!ends) return null;
    const each = (machine.fullsteps * 2 ** state.resolution) / machine.turn;
    const now = state.position - state.place * each;
    // The rotor trails the field by up to two full steps; what is more is a lost step or another zero.
    if (state.speed === 0 || !(Math.abs(now - offset.current) < 3 * 2 ** state.resolution))
        offset.current = Math.round(now);
    const [low, high] = ends.map(end => Math.round(offset.current + end * each)).sort((a, b) => a - b);
    return { low: low!, high: high! };
}

/** Pixels of the canvas beside the way, where half a carriage stands at its end. */
const BESIDE = 8;

/** Zero, the target and the position; the target is faint while the motor turns at a speed. */
function drawWay({ ctx, width, colour }: Pen, { low, high }: Way, { position, target, mode }: MotorState): void {
    const part = (value: number) => (Math.max(low, Math.min(high, value)) - low) / (high - low);
    const at = (value: number) => BESIDE + part(value) * (width - 2 * BESIDE);
    ctx.fillStyle = colour("--faint");
    ctx.fillRect(Math.round(at(0)), 7, 1, 9);
    ctx.fillStyle = colour("--text");
    ctx.globalAlpha = mode === 0 ? 1 : 0.2;
    const goal = at(target);
    ctx.beginPath();
    ctx.moveTo(goal - 5, 1);
    ctx.lineTo(goal + 5, 1);
    ctx.lineTo(goal, 7);
    ctx.fill();
    ctx.globalAlpha = 1;
    ctx.fillStyle = colour("--motor");
    ctx.beginPath();
    ctx.roundRect(at(position) - 7, 7, 14, 9, 2);
    ctx.fill();
}

/** The way of an axis with ends, or between where the motor has been: position, target, switches. */
export function Rail({ motor }: { motor: number }) {
    const way = useRef<Way>({ low: -1000, high: 1000 });
    const offset = useRef(NaN);
    const labels = useSignal<[string, string]>(["", ""]);
    const axis = world.value?.axes[motor];
    const ends = axis && machineEnds(axis);
    const draw = (pen: Pen) => {
        const state = motors[motor]!.value;
        way.current = machineWay(motor, state, offset) ?? openWay(way.current, farthest(state));
        const shown: [string, string] = [grouped(way.current.low), grouped(way.current.high)];
        if (String(labels.peek()) !== String(shown)) labels.value = shown;
        drawWay(pen, way.current, state);
    };
    return (
        <div class="rail">
            <span>{labels.value[0]}</span>
            <div
                class="way"
                role="img"
                aria-label={`Position of motor ${motor}`}
                title={
                    ends
                        ? `${axis.low ?? ends[0]} to ${axis.high ?? ends[1]} ${axis.unit}; marks are the switches`
                        : undefined
                }
            >
                {ends &&
                    axis.cams.map((cam, n) => (
                        <Cam key={n} motor={motor} cam={cam} ends={ends} flipped={axis.turn < 0} />
                    ))}
                <Sketch draw={draw} />
            </div>
            <span>{labels.value[1]}</span>
        </div>
    );
}

/** The lowest and highest place of an axis that has both; its switches where it has no hard stops. */
function machineEnds({ unit, low, high, cams }: AxisWorld): [number, number] | null {
    if (unit !== "mm") return null;
    const places = [low, high, ...cams.flatMap(cam => [cam.low, cam.high])].filter(place => place !== null);
    const first = Math.min(...places);
    const last = Math.max(...places);
    return places.length > 1 && first < last ? [first, last] : null;
}

/** Where a switch is pressed. */
function Cam({
    motor,
    cam,
    ends: [first, last],
    flipped,
}: {
    motor: number;
    cam: CamPlace;
    ends: [number, number];
    flipped: boolean;
}) {
    const part = (place: number) => ((place - first) / (last - first)) * 100;
    const from = part(Math.max(first, cam.low ?? first));
    const to = part(Math.min(last, cam.high ?? last));
    const style = { [flipped ? "right" : "left"]: `${from}%`, width: `${to - from}%` };
    return (
        <i
            class={`cam ${flag(motor, cam.side) ? "on" : ""}`}
            style={style}
            title={`${cam.side} switch`}
            data-side={cam.side}
        />
    );
}
