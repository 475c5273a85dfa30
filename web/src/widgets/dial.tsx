// A motor's dial: the rotor as it stands, the speed as an arc.  The rotor is a layer of its own, which the browser
// turns without painting anything anew.
import { rangeOf } from "../logic/scales";
import { useRef } from "preact/hooks";
import { MOTOR_FLAGS } from "../wire";
import { motors, powered, welcome } from "../logic/app";
import { useFrameEffect } from "./frame";

const R = 47;
const BOX = "-56 -56 112 112";

function arc(fraction: number): string {
    const clipped = Math.max(-1, Math.min(1, fraction));
    const angle = clipped * 0.75 * Math.PI;
    const point = (a: number) => `${(R * Math.sin(a)).toFixed(2)} ${(-R * Math.cos(a)).toFixed(2)}`;
    return `M${point(0)}A${R} ${R} 0 0 ${angle >= 0 ? 1 : 0} ${point(angle)}`;
}

const TICKS = Array.from({ length: 50 }, (_, n) => {
    const angle = (n / 50) * 2 * Math.PI;
    const inner = n % 5 ? 36.5 : 34;
    const at = (r: number) => `${(r * Math.sin(angle)).toFixed(1)} ${(-r * Math.cos(angle)).toFixed(1)}`;
    return `M${at(inner)}L${at(39)}`;
}).join("");

export function Dial({ motor }: { motor: number }) {
    const rotor = useRef<SVGSVGElement>(null);
    const field = useRef<SVGPathElement>(null);
    const speed = useRef<SVGPathElement>(null);
    const shown = useRef({ speed: NaN, slip: NaN });
    useFrameEffect(() => {
        const state = motors[motor]!.value;
        const turn = ((state.angle / Math.PI) * 180) % 360;
        if (rotor.current) rotor.current.style.transform = `rotate(${turn.toFixed(2)}deg)`;
        if (state.slip !== 0 || shown.current.slip !== 0) {
            shown.current.slip = state.slip;
            field.current?.setAttribute("transform", `rotate(${(turn + (state.slip / 200) * 360).toFixed(1)})`);
            field.current?.classList.toggle("away", state.slip !== 0);
        }
        if (state.speed !== shown.current.speed) {
            shown.current.speed = state.speed;
            speed.current?.setAttribute(
                "d",
                arc(Math.sign(state.speed) * Math.sqrt(Math.abs(state.speed) / rangeOf("max_speed").high)),
            );
        }
        // Where step and direction leave the board, the coil current is the outside driver's own.
        const alive = welcome.value?.model.drivers ? (state.flags & MOTOR_FLAGS.energised) !== 0 : powered.value;
        rotor.current?.classList.toggle("dead", !alive);
    });
    return (
        <div class={`dial motor${motor}`} role="img" aria-label={`Rotor of motor ${motor}`}>
            <svg viewBox={BOX}>
                <path class="track" d={`${arc(-1)}${arc(1)}`} />
                <path class="speed" ref={speed} d="" />
                <path class="ticks" d={TICKS} />
                <path class="coil" ref={field} d="M0 -42 3 -47 -3 -47Z" />
            </svg>
            <svg viewBox={BOX} class="rotor" ref={rotor}>
                <circle r="31" class="disc" />
                <path class="flat" d="M-3.200 -28h6.400l-1.200 19h-4Z" />
                <path class="spoke" d="M0 9v17M-8 4.500-22.500 13M8 4.500 22.500 13" />
                <circle r="6.5" class="hub" />
                <circle r="2" class="shaft" />
            </svg>
        </div>
    );
}
