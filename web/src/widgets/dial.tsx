// A motor's dial: the rotor as it stands, the speed as an arc.
import { useComputed } from "@preact/signals";
import { motors, powered, welcome } from "../logic/app";
import { rangeOf } from "../logic/scales";
import { MOTOR_FLAGS, type MotorState } from "../wire";
import { Sketch, type Pen } from "./sketch";

const R = 47;
const SIZE = 112;
/** The arc of the largest speed, to either side of the top. */
const REACH = 0.75 * Math.PI;
const TOP = -Math.PI / 2;
const ROUND = 2 * Math.PI;
const FULL_STEPS = 200;

const TICKS = Array.from({ length: 50 }, (_, n) => {
    const angle = (n / 50) * ROUND;
    const inner = n % 5 ? 36.5 : 34;
    const at = (r: number) => `${(r * Math.sin(angle)).toFixed(1)} ${(-r * Math.cos(angle)).toFixed(1)}`;
    return `M${at(inner)}L${at(39)}`;
}).join("");
const end = (R * Math.SQRT1_2).toFixed(2);
const TRACK = `M-${end} ${end}A${R} ${R} 0 1 1 ${end} ${end}`;

const FIELD = new Path2D("M0 -42 3 -47 -3 -47Z");
const FLAT = new Path2D("M-3.200 -28h6.400l-1.200 19h-4Z");
const SPOKES = new Path2D("M0 9v17M-8 4.500-22.500 13M8 4.500 22.500 13");

function disc(ctx: CanvasRenderingContext2D, radius: number): void {
    ctx.beginPath();
    ctx.arc(0, 0, radius, 0, ROUND);
    ctx.fill();
}

function speedArc({ ctx, colour }: Pen, speed: number): void {
    const part = Math.min(1, Math.sqrt(Math.abs(speed) / rangeOf("max_speed").high));
    if (!part) return;
    ctx.strokeStyle = colour("--motor");
    ctx.lineWidth = 5;
    ctx.beginPath();
    ctx.arc(0, 0, R, TOP, TOP + Math.sign(speed) * part * REACH, speed < 0);
    ctx.stroke();
}

function rotor({ ctx, colour }: Pen): void {
    ctx.lineWidth = 1;
    ctx.fillStyle = colour("--button");
    ctx.strokeStyle = colour("--edge");
    disc(ctx, 31);
    ctx.stroke();
    ctx.fillStyle = colour("--motor");
    ctx.fill(FLAT);
    ctx.strokeStyle = colour("--faint");
    ctx.lineWidth = 3;
    ctx.stroke(SPOKES);
    ctx.lineWidth = 1;
    ctx.fillStyle = colour("--raised");
    disc(ctx, 6.5);
    ctx.stroke();
    ctx.fillStyle = colour("--muted");
    disc(ctx, 2);
}

function drawDial(pen: Pen, { angle, slip, speed }: MotorState): void {
    const { ctx, width, height, colour } = pen;
    ctx.translate(width / 2, height / 2);
    ctx.scale(width / SIZE, height / SIZE);
    ctx.lineCap = "round";
    speedArc(pen, speed);
    ctx.rotate(angle % ROUND);
    rotor(pen);
    if (!slip) return;
    ctx.rotate((slip / FULL_STEPS) * ROUND);
    ctx.fillStyle = colour("--bad");
    ctx.fill(FIELD);
}

export function Dial({ motor }: { motor: number }) {
    // Where step and direction leave the board, the coil current is the outside driver's own.
    const dead = useComputed(() =>
        welcome.value?.model.drivers ? !(motors[motor]!.value.flags & MOTOR_FLAGS.energised) : !powered.value,
    );
    return (
        <div class={`dial motor${motor} ${dead.value ? "dead" : ""}`} role="img" aria-label={`Rotor of motor ${motor}`}>
            <svg viewBox="-56 -56 112 112">
                <path class="track" d={TRACK} />
                <path class="ticks" d={TICKS} />
            </svg>
            <Sketch draw={pen => drawDial(pen, motors[motor]!.value)} />
        </div>
    );
}
