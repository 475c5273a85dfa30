// A switch in the drawing: a click or a key holds it closed, another releases it.
import type { JSX } from "preact";
import { ask, flag, motors, world } from "../../logic/app";
import type { Side } from "../../logic/machine";

const KEYS = new Set(["Enter", " "]);

interface Props {
    motor: number;
    side: Side;
    /** Where its middle is. */
    x: number;
    y: number;
    /** Its line has another switch of this side before it: the reference switch. */
    reference: boolean;
}

export function Contact({ motor, side, x, y, reference }: Props): JSX.Element {
    void motors[motor]!.value;
    const axis = world.value!.axes[motor]!;
    const held = side === "left" ? axis.left_held : axis.right_held;
    const closed = flag(motor, side);
    const name = `${reference ? "reference" : side} switch of motor ${motor}`;
    const change = () => void ask({ call: "set_bench", what: side, index: motor, value: held ? 0 : 1, fault: "" });
    const press = (event: KeyboardEvent) => {
        if (!KEYS.has(event.key)) return;
        event.preventDefault();
        change();
    };
    return (
        <g
            class={`contact ${closed ? "closed" : ""} ${held ? "held" : ""}`}
            transform={`translate(${x.toFixed(1)} ${y.toFixed(1)})`}
            role="button"
            tabindex={0}
            aria-pressed={closed}
            aria-label={name}
            onClick={change}
            onKeyDown={press}
        >
            <title>{`${held ? "Release" : "Close"} the ${name}`}</title>
            <rect class="area" x="-15" y="-12" width="30" height="24" rx="5" />
            <circle cx="-8" cy="4" r="2.2" />
            <circle cx="8" cy="4" r="2.2" />
            <path d={closed ? "M-8 4H8" : "M-8 4 7-5"} />
        </g>
    );
}
