// The three axes: what each motor does, and everything to move it by hand.
import { useComputed, useSignal, useSignalEffect } from "@preact/signals";
import { useRef } from "preact/hooks";
import { MOTOR_FLAGS } from "../wire";
import { axisParameter, can, figures, flag, motors, online, powered, send, setAxis, tables, welcome } from "../logic/app";
import { parameters } from "../logic/parameters";
import { remembered } from "../logic/settings";
import { grouped, rate, rpm, short, type Scale } from "../logic/units";
import { Dial } from "../widgets/dial";
import { Empty, NumberField, Lamp } from "../widgets/basics";
import { Icon } from "../widgets/icons";

export const FULLSTEPS = 200;
const MODES = ["position", "soft", "velocity"];

/** Scale of a motor's units, from its parameters as last read. */
export function scaleOf(motor: number): Scale {
    const value = (key: string) => parameters.value.axis.get(axisParameter(key).number)?.[motor] ?? axisParameter(key).default;
    return {
        clock_hz: tables.value.clock_hz, pulse_div: value("pulse_divisor"), ramp_div: value("ramp_divisor"),
        resolution: figures[motor]!.value.resolution, fullsteps_per_turn: FULLSTEPS,
    };
}

const jogSpeed = remembered<number[]>("jog", [400, 400, 400]);
const moveTo = remembered<number[]>("move", [10000, 10000, 10000]);

/** Turns while it is held, with pointer or key; anything that ends the hold stops the motor. */
function Jog({ motor, direction }: { motor: number; direction: -1 | 1 }) {
    const held = useSignal(false);
    const start = () => {
        if (held.value || !online.value) return;
        held.value = true;
        void send(direction > 0 ? "ROR" : "ROL", 0, motor, jogSpeed.value[motor]!);
    };
    const end = () => {
        if (!held.value) return;
        held.value = false;
        void send("MST", 0, motor);
    };
    const hold = (event: KeyboardEvent) => {
        if (event.key !== " " && event.key !== "Enter") return;
        event.preventDefault();
        if (!event.repeat) start();
    };
    const name = direction > 0 ? "right" : "left";
    return (
        <button class={`jog ${held.value ? "held" : ""}`} disabled={!online.value}
            title={`Hold to turn ${name} at speed ${jogSpeed.value[motor]}`} aria-label={`Jog motor ${motor} ${name}`}
            onPointerDown={(event) => {
                (event.currentTarget as HTMLElement).setPointerCapture(event.pointerId);
                start();
            }}
            onPointerUp={end} onPointerCancel={end} onLostPointerCapture={end} onBlur={end}
            onContextMenu={(event) => event.preventDefault()}
            onKeyDown={hold} onKeyUp={end}>
            <Icon name={direction > 0 ? "turnRight" : "turnLeft"} />
        </button>
    );
}

/** The way between where the motor has been, with position and target on it. */
function Rail({ motor }: { motor: number }) {
    const carriage = useRef<HTMLDivElement>(null);
    const goal = useRef<HTMLDivElement>(null);
    const range = useRef({ low: -1000, high: 1000 });
    const labels = useSignal<[string, string]>(["", ""]);
    useSignalEffect(() => {
        const { position, target, mode } = motors[motor]!.value;
        const wide = range.current;
        const far = Math.max(Math.abs(position), mode === 0 ? Math.abs(target) : 0);
        if (far > wide.high || far < wide.high / 40) {
            const size = 10 ** Math.floor(Math.log10(Math.max(far, 100)));
            const high = [1, 2, 5, 10, 20].map((n) => n * size).find((n) => n >= far * 1.15)!;
            range.current = { low: -high, high };
        }
        const { low, high } = range.current;
        if (labels.peek()[1] !== grouped(high)) labels.value = [grouped(low), grouped(high)];
        const place = (value: number) => `translateX(${(((Math.max(low, Math.min(high, value)) - low) / (high - low)) * 100).toFixed(2)}%)`;
        if (carriage.current) carriage.current.style.transform = place(position);
        if (goal.current && goal.current.dataset.at !== `${target} ${mode}`) {
            goal.current.dataset.at = `${target} ${mode}`;
            goal.current.style.transform = place(target);
            goal.current.classList.toggle("unused", mode !== 0);
        }
    });
    return (
        <div class="rail">
            <div class="way" role="img" aria-label={`Position of motor ${motor}`}>
                <div class="slide goal" ref={goal}><i /></div>
                <div class="slide carriage" ref={carriage}><i /></div>
            </div>
            <span class="low">{labels.value[0]}</span><span class="high">{labels.value[1]}</span>
        </div>
    );
}

function Bar({ value, top, tone, label }: { value: number; top: number; tone: string; label: string }) {
    return (
        <span class={`bar ${tone}`} role="meter" aria-label={label} aria-valuenow={value} aria-valuemax={top}>
            <span style={{ width: `${Math.min(100, (value / top) * 100)}%` }} />
        </span>
    );
}

const ERRORS = ["overcurrent A", "overcurrent B", "open load A", "open load B", "overcurrent high side",
    "undervoltage", "temperature warning", "overtemperature"];

function Axis({ motor }: { motor: number }) {
    const position = useComputed(() => grouped(figures[motor]!.value.position));
    const target = useComputed(() => grouped(figures[motor]!.value.target));
    const speed = useComputed(() => grouped(figures[motor]!.value.speed));
    const unit = useComputed(() => {
        const scale = scaleOf(motor);
        const now = figures[motor]!.value.speed;
        return `${short(rate(scale, now) / 1000)} k\u00b5steps/s · ${short(rpm(scale, now))} rpm`;
    });
    const load = useComputed(() => motors[motor]!.value.load);
    const still = useComputed(() => motors[motor]!.value.speed === 0);
    const current = useComputed(() => motors[motor]!.value.current);
    const mode = useComputed(() => motors[motor]!.value.mode);
    const search = useComputed(() => motors[motor]!.value.search);
    const errors = useComputed(() => motors[motor]!.value.errors);
    const slip = useComputed(() => motors[motor]!.value.slip);
    const flags = useComputed(() => motors[motor]!.value.flags);
    const drivers = (welcome.value?.model.max_current_ma ?? 0) > 0;
    const on = (name: keyof typeof MOTOR_FLAGS) => (flags.value & MOTOR_FLAGS[name]) !== 0;
    const state = !powered.value ? "no power" : search.value ? `reference search, step ${search.value}`
        : on("stalled") ? "stalled" : slip.value ? `${Math.abs(slip.value)} full steps lost`
        : on("reached") && mode.value === 0 ? "at target" : MODES[mode.value] + " mode";
    const tone = on("stalled") || slip.value || errors.value ? "bad" : on("reached") && mode.value === 0 ? "good" : "";
    const top = welcome.value?.model.max_current_ma ?? 0;
    return (
        <section class={`axis motor${motor}`} aria-label={`Motor ${motor}`}>
            <header>
                <span class="name">Motor {motor}</span>
                <span class={`state ${tone}`}>{state}</span>
                <span class="lamps">
                    <label title="Left stop switch (axis parameter 11)">L<Lamp on={on("left")} label="left switch" tone={on("left_off") ? "off" : "warn"} /></label>
                    <label title="Right stop switch (axis parameter 10)">R<Lamp on={on("right")} label="right switch" tone={on("right_off") ? "off" : "warn"} /></label>
                </span>
            </header>
            <Dial motor={motor} />
            <dl class="figures">
                <div class="big"><dt>position</dt><dd data-figure="position">{position}</dd></div>
                <div><dt>target</dt><dd class={mode.value === 0 ? "" : "muted"} data-figure="target">{target}</dd></div>
                <div><dt>speed</dt><dd data-figure="speed">{speed}</dd></div>
                <div class="unit">{unit}</div>
                {drivers && (
                    <div class="meters">
                        <span title="Load value of the driver, 0 to 7 (axis parameter 206)">load <Bar value={load.value} top={7} tone={still.value ? "load idle" : "load"} label="load" /> <b>{load}</b></span>
                        <span title="Coil current now">{top ? `${Math.round((current.value / 255) * top)} mA` : "current"} <Bar value={current.value} top={255} tone="current" label="current" /></span>
                    </div>
                )}
                {errors.value > 0 && (
                    <div class="errors">{ERRORS.filter((_, bit) => errors.value & (1 << bit)).join(", ")}</div>
                )}
            </dl>
            <Rail motor={motor} />
            <footer>
                <Jog motor={motor} direction={-1} />
                <NumberField class="speed" value={jogSpeed.value[motor]!} low={0} high={2047} label={`Jog speed of motor ${motor}`}
                    onCommit={(value) => (jogSpeed.value = jogSpeed.value.with(motor, value))} />
                <Jog motor={motor} direction={1} />
                <button class="stop" disabled={!online.value} title={`Stop motor ${motor} along its ramp (Alt+${motor + 1})`}
                    aria-label={`Stop motor ${motor}`} onClick={() => send("MST", 0, motor)}><Icon name="stop" /></button>
                <span class="gap" />
                <NumberField class="to" value={moveTo.value[motor]!} low={-8388608} high={8388607} label={`Destination of motor ${motor}`}
                    onCommit={(value) => (moveTo.value = moveTo.value.with(motor, value))} />
                <button disabled={!online.value} title="Move to this position" aria-label={`Move motor ${motor} to`}
                    onClick={() => send("MVP", 0, motor, moveTo.value[motor])}>to</button>
                <button disabled={!online.value} title="Move by this distance from where the motor is" aria-label={`Move motor ${motor} by`}
                    onClick={() => send("MVP", 1, motor, moveTo.value[motor])}>by</button>
                <button disabled={!online.value} title="Call this place zero" aria-label={`Zero motor ${motor}`}
                    onClick={() => zero(motor)}>0</button>
                <button class={search.value ? "active" : ""} disabled={!online.value} aria-label={`Reference search of motor ${motor}`}
                    title={search.value ? "Abort the reference search" : "Start the reference search"}
                    onClick={() => send("RFS", search.value ? 1 : 0, motor)}><Icon name="home" /></button>
            </footer>
        </section>
    );
}

async function zero(motor: number): Promise<void> {
    await send("MST", 0, motor);
    await setAxis("target_position", motor, 0);
    await setAxis("actual_position", motor, 0);
}

export function Axes() {
    if (!welcome.value) return <Empty icon="plug" title="No module yet">Waiting for the IDE's server.</Empty>;
    return <div class="axes">{[0, 1, 2].map((motor) => <Axis key={motor} motor={motor} />)}</div>;
}

export { can, flag };
