// The way of an axis: position, target, and the switches that a bench has.
import { useSignal } from "@preact/signals";
import { useRef } from "preact/hooks";
import { flag, motors, world } from "../../logic/app";
import { grouped } from "../../logic/units";
import type { AxisWorld, Cam as CamPlace } from "../../wire";
import { useFrameEffect } from "../../widgets/frame";

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

/** The way of an axis with ends, or between where the motor has been: position, target, switches. */
export function Rail({ motor }: { motor: number }) {
    const carriage = useRef<HTMLDivElement>(null);
    const goal = useRef<HTMLDivElement>(null);
    const zero = useRef<HTMLElement>(null);
    const way = useRef<Way>({ low: -1000, high: 1000 });
    const offset = useRef(NaN);
    const labels = useSignal<[string, string]>(["", ""]);
    const axis = world.value?.axes[motor];
    const ends = axis && machineEnds(axis);
    useFrameEffect(() => {
        const { position, target, mode, place, speed, resolution } = motors[motor]!.value;
        const machine = world.value?.axes[motor];
        const limits = machine && machineEnds(machine);
        if (limits) {
            const each = (machine.fullsteps * 2 ** resolution) / machine.turn;
            const now = position - place * each;
            // The rotor trails the field by up to two full steps; what is more is a lost step or another zero.
            if (speed === 0 || !(Math.abs(now - offset.current) < 3 * 2 ** resolution))
                offset.current = Math.round(now);
            const at = limits.map(end => Math.round(offset.current + end * each)).sort((a, b) => a - b);
            way.current = { low: at[0]!, high: at[1]! };
        } else way.current = openWay(way.current, Math.max(Math.abs(position), mode === 0 ? Math.abs(target) : 0));
        const { low, high } = way.current;
        if (labels.peek()[1] !== grouped(high) || labels.peek()[0] !== grouped(low))
            labels.value = [grouped(low), grouped(high)];
        const part = (value: number) => ((Math.max(low, Math.min(high, value)) - low) / (high - low)) * 100;
        const move = (value: number) => `translateX(${part(value).toFixed(2)}%)`;
        if (carriage.current) carriage.current.style.transform = move(position);
        const key = `${target} ${mode} ${low} ${high}`;
        if (goal.current && goal.current.dataset.at !== key) {
            goal.current.dataset.at = key;
            goal.current.style.transform = move(target);
            goal.current.classList.toggle("unused", mode !== 0);
            zero.current?.style.setProperty("left", `${part(0).toFixed(1)}%`);
        }
    });
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
                <i class="zero" ref={zero} />
                <div class="slide goal" ref={goal}>
                    <i />
                </div>
                <div class="slide carriage" ref={carriage}>
                    <i />
                </div>
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
