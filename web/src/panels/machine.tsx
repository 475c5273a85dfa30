// The machine: what the bench describes, drawn from its description and the state of its loads.
import type { JSX } from "preact";
import { useEffect } from "preact/hooks";
import { can, figures, welcome, world } from "../logic/app";
import type { Pair } from "../logic/trail";
import { Empty } from "../widgets/basics";
import type { AxisWorld } from "../wire";
import { marks, readMarks } from "./machine/marks";
import { Plane } from "./machine/plane";
import { Belt, Rail } from "./machine/rail";
import { Shaft, Turntable } from "./machine/round";

const MARKS_MS = 2000;

const SHAPES: Record<AxisWorld["shape"], (motor: number, axis: AxisWorld) => JSX.Element> = {
    rail: (motor, axis) => <Rail motor={motor} axis={axis} marks={marks.value} />,
    belt: (motor, axis) => <Belt motor={motor} axis={axis} />,
    turntable: (motor, axis) => <Turntable motor={motor} axis={axis} />,
    shaft: motor => <Shaft motor={motor} />,
};

/** What an axis is called, where its load is, and how many steps it lost. */
function Caption({ motor, axis }: { motor: number; axis: AxisWorld }): JSX.Element {
    const { place, slip } = figures[motor]!.value;
    return (
        <h4 class={`motor${motor}`}>
            <span class="name">{axis.name || `Motor ${motor}`}</span>
            <span class="place" data-place={motor}>
                {place.toFixed(2).replace("-", "\u2212")} {axis.unit}
            </span>
            {slip !== 0 && <span class="bad">{Math.abs(slip)} full steps lost</span>}
        </h4>
    );
}

function AxisDrawing({ motor, axis }: { motor: number; axis: AxisWorld }): JSX.Element {
    return (
        <section class={`drawing of-${axis.shape} motor${motor}`} aria-label={`Drawing of motor ${motor}`}>
            <Caption motor={motor} axis={axis} />
            {SHAPES[axis.shape](motor, axis)}
        </section>
    );
}

export function Machine(): JSX.Element {
    useEffect(() => {
        void readMarks();
        const timer = setInterval(() => void readMarks(), MARKS_MS);
        return () => clearInterval(timer);
    }, []);
    if (!welcome.value || !can.value.bench || !world.value)
        return (
            <Empty icon="plug" title="No bench">
                A drawing of the machine comes with a virtual module: start <code>tmcm34x ide</code> without{" "}
                <code>--port</code>.
            </Empty>
        );
    const { axes, plane } = world.value;
    const pair = plane.length === 2 ? ([plane[0]!, plane[1]!] as Pair) : null;
    return (
        <div class="machine">
            {pair && (
                <section class="drawing of-plane" aria-label={`Drawing of motors ${pair[0]} and ${pair[1]}`}>
                    {pair.map(motor => (
                        <Caption key={motor} motor={motor} axis={axes[motor]!} />
                    ))}
                    <Plane pair={pair} marks={marks.value} />
                </section>
            )}
            {axes.map((axis, motor) => !pair?.includes(motor) && <AxisDrawing key={motor} motor={motor} axis={axis} />)}
            <p class="muted note only-with-contacts">A click on a switch holds it closed; another click releases it.</p>
        </div>
    );
}
