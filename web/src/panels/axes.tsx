// The three axes: what each motor does, and everything to move it by hand.
import { useComputed, useSignal, useSignalEffect } from "@preact/signals";
import { useEffect, useRef } from "preact/hooks";
import { MOTOR_FLAGS, type AxisWorld, type Cam as CamPlace } from "../wire";
import {
    age,
    ask,
    connection,
    figures,
    flag,
    motorKnown,
    motors,
    online,
    powered,
    reachable,
    send,
    stale,
    tables,
    welcome,
    world,
} from "../logic/app";
import { choose } from "../logic/confirm";
import { remembered } from "../logic/settings";
import { grouped, rate, rpm, short, type Scale } from "../logic/units";
import { Dial } from "../widgets/dial";
import { abort, motionOf, notReady, ready } from "../logic/authority";
import { Empty, Lamp } from "../widgets/basics";
import { LocalNumber } from "../widgets/fields";
import { Icon } from "../widgets/icons";

export const FULLSTEPS = 200;

/** Scale of a motor's units, from its parameters as last read. */
export function scaleOf(motor: number): Scale {
    const { pulse_div, ramp_div, resolution } = figures[motor]!.value;
    return {
        clock_hz: tables.value.clock_hz,
        pulse_div,
        ramp_div,
        resolution,
        fullsteps_per_turn: world.value?.axes[motor]?.fullsteps ?? FULLSTEPS,
    };
}

const jogSpeed = remembered<(number | null)[]>("jog", [400, 400, 400]);
const moveTo = remembered<(number | null)[]>("move", [10000, 10000, 10000]);

/** What a press of an arrow does: 0 turns while it is held, else it moves by so many microsteps, full steps or degrees. */
const STRIDES = [
    ["hold", "hold"],
    ["1", "1 \u00b5step"],
    ["10", "10 \u00b5steps"],
    ["100", "100 \u00b5steps"],
    ["fullstep", "1 full step"],
    ["1deg", "1\u00b0"],
    ["10deg", "10\u00b0"],
    ["mm", "1 mm"],
] as const;
type Stride = (typeof STRIDES)[number][0];
const strides = remembered<Stride[]>("strides", ["hold", "hold", "hold"]);

/** Microsteps of a stride of a motor. */
function microsteps(motor: number, stride: Stride): number {
    const { resolution } = figures[motor]!.value;
    const axis = world.value?.axes[motor];
    const turn = (axis?.fullsteps ?? FULLSTEPS) * 2 ** resolution;
    switch (stride) {
        case "fullstep":
            return 2 ** resolution;
        case "1deg":
            return Math.round(turn / 360);
        case "10deg":
            return Math.round(turn / 36);
        case "mm":
            return axis ? Math.round(turn / Math.abs(axis.turn)) : 0;
        default:
            return Number(stride);
    }
}

/** Millimetres are offered where a bench says what one is. */
const stridesOf = (motor: number) =>
    STRIDES.filter(([stride]) => stride !== "mm" || world.value?.axes[motor]?.unit === "mm");

/** The server stops a motor of whose button it has not heard for a second. */
const AGAIN_MS = 250;

/** Turns while it is held, with pointer or key; anything that ends the hold or the sight of it stops the motor. */
function Jog({ motor, direction }: { motor: number; direction: -1 | 1 }) {
    const held = useSignal(false);
    const timer = useRef(0);
    const say = (velocity: number) => connection.call({ call: "jog", motor, velocity }).catch(() => {});
    const start = () => {
        const speed = jogSpeed.value[motor];
        if (held.value || !ready.value || speed == null) return;
        const stride = strides.value[motor]!;
        if (stride !== "hold") return void send("MVP", 1, motor, direction * microsteps(motor, stride));
        held.value = true;
        const velocity = direction * speed;
        void ask({ call: "jog", motor, velocity });
        timer.current = window.setInterval(() => void say(velocity), AGAIN_MS);
    };
    const end = () => {
        if (!held.peek()) return;
        held.value = false;
        clearInterval(timer.current);
        void say(0);
    };
    useEffect(() => {
        const ends = [
            [window, "blur"],
            [window, "pagehide"],
            [document, "visibilitychange"],
        ] as const;
        for (const [where, what] of ends) where.addEventListener(what, end);
        return () => {
            for (const [where, what] of ends) where.removeEventListener(what, end);
            end();
        };
    }, []);
    useSignalEffect(() => {
        if (!ready.value) end();
    });
    const hold = (event: KeyboardEvent) => {
        if (event.key !== " " && event.key !== "Enter") return;
        event.preventDefault();
        if (!event.repeat) start();
    };
    const name = direction > 0 ? "right" : "left";
    return (
        <button
            class={`jog ${held.value ? "held" : ""}`}
            disabled={!ready.value || jogSpeed.value[motor] == null}
            title={
                notReady.value ||
                (strides.value[motor] === "hold"
                    ? `Hold to turn ${name} at speed ${jogSpeed.value[motor]}`
                    : `Move ${name} by ${strides.value[motor]}`)
            }
            aria-label={`Jog motor ${motor} ${name}`}
            onPointerDown={event => {
                if (event.button !== 0) return;
                event.currentTarget.setPointerCapture(event.pointerId);
                start();
            }}
            onPointerUp={end}
            onPointerCancel={end}
            onLostPointerCapture={end}
            onBlur={end}
            onContextMenu={event => event.preventDefault()}
            onKeyDown={hold}
            onKeyUp={end}
        >
            <Icon name={direction > 0 ? "jogRight" : "jogLeft"} />
        </button>
    );
}

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
function Rail({ motor }: { motor: number }) {
    const carriage = useRef<HTMLDivElement>(null);
    const goal = useRef<HTMLDivElement>(null);
    const zero = useRef<HTMLElement>(null);
    const way = useRef<Way>({ low: -1000, high: 1000 });
    const offset = useRef(NaN);
    const labels = useSignal<[string, string]>(["", ""]);
    const axis = world.value?.axes[motor];
    const ends = axis && machineEnds(axis);
    useSignalEffect(() => {
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

function Bar({ value, top, tone, label }: { value: number; top: number; tone: string; label: string }) {
    return (
        <span class={`bar ${tone}`} role="meter" aria-label={label} aria-valuenow={value} aria-valuemax={top}>
            <span style={{ width: `${Math.min(100, (value / top) * 100)}%` }} />
        </span>
    );
}

const UNKNOWN = "\u2013";

/** What a motor does, in words that are true of the values that came last. */
function stateOf(motor: number): string {
    if (!powered.value) return "no power";
    if (age.value === null) return "unknown";
    if (age.value > 0) return `as of ${age.value} s ago`;
    if (
        !(["speed", "target", "target_speed", "mode", "flags", "search"] as const).every(name =>
            motorKnown(motor, name),
        )
    )
        return "unknown";
    const { speed, target, target_speed: wanted, mode, search, slip, flags } = figures[motor]!.value;
    const on = (name: keyof typeof MOTOR_FLAGS) => (flags & MOTOR_FLAGS[name]) !== 0;
    if (search) return `reference search, step ${search}`;
    if (on("stalled")) return "stalled";
    if (slip) return `${Math.abs(slip)} full steps lost`;
    const way = mode === 0 ? target - figures[motor]!.value.position : wanted;
    if (!speed && way < 0 && on("left") && !on("left_off")) return "stopped by the left switch";
    if (!speed && way > 0 && on("right") && !on("right_off")) return "stopped by the right switch";
    if (mode === 0)
        return on("reached")
            ? "at target"
            : speed
              ? `moving to ${grouped(target)}`
              : `stands, target ${grouped(target)}`;
    if (!speed && !wanted) return "stopped";
    return speed === wanted
        ? `turning ${speed > 0 ? "right" : "left"}`
        : wanted
          ? `turning ${wanted > 0 ? "right" : "left"}, ramp`
          : "slowing down";
}

const ERRORS = [
    "overcurrent A",
    "overcurrent B",
    "open load A",
    "open load B",
    "overcurrent high side",
    "undervoltage",
    "temperature warning",
    "overtemperature",
];

function Axis({ motor }: { motor: number }) {
    const shown = (name: "position" | "target" | "speed") =>
        useComputed(() => (motorKnown(motor, name) ? grouped(figures[motor]!.value[name]) : UNKNOWN));
    const position = shown("position");
    const target = shown("target");
    const speed = shown("speed");
    const unit = useComputed(() => {
        if (!(["speed", "resolution", "pulse_div", "ramp_div"] as const).every(name => motorKnown(motor, name)))
            return UNKNOWN;
        const scale = scaleOf(motor);
        const now = figures[motor]!.value.speed;
        const axis = world.value?.axes[motor];
        const place =
            axis && (axis.unit !== "mm" || axis.low !== null || axis.high !== null || axis.cams.length)
                ? `${figures[motor]!.value.place.toFixed(2).replace("-", "\u2212")} ${axis.unit} \u00b7 `
                : "";
        return `${place}${short(rpm(scale, now))} rpm \u00b7 ${short(rate(scale, now) / 1000)} k\u00b5steps/s`;
    });
    const load = useComputed(() => motors[motor]!.value.load);
    const still = useComputed(() => motors[motor]!.value.speed === 0);
    const current = useComputed(() => motors[motor]!.value.current);
    const mode = useComputed(() => (motorKnown(motor, "mode") ? motors[motor]!.value.mode : 0));
    const search = useComputed(() => motors[motor]!.value.search);
    const errors = useComputed(() => motors[motor]!.value.errors);
    const slip = useComputed(() => motors[motor]!.value.slip);
    const flags = useComputed(() => motors[motor]!.value.flags);
    const drivers = (welcome.value?.model.max_current_ma ?? 0) > 0;
    const on = (name: keyof typeof MOTOR_FLAGS) => (flags.value & MOTOR_FLAGS[name]) !== 0;
    const words = useComputed(() => stateOf(motor));
    const state = words.value;
    const tone = on("stalled") || slip.value || errors.value ? "bad" : state === "at target" ? "good" : "";
    const top = welcome.value?.model.max_current_ma ?? 0;
    const goal = moveTo.value[motor] ?? null;
    return (
        <section class={`axis motor${motor} ${stale.value ? "stale" : ""}`} aria-label={`Motor ${motor}`}>
            <header>
                <span class="name">Motor {motor}</span>
                <span class={`state ${tone}`}>{state}</span>
                {still.value && (
                    <button
                        class="link"
                        disabled={!reachable.value}
                        title="Ask the module why this motor does not turn"
                        onClick={() => void askWhy(motor)}
                    >
                        why?
                    </button>
                )}
                <select
                    class="stride"
                    aria-label={`Step of the arrows of motor ${motor}`}
                    title="What a press of an arrow does"
                    value={strides.value[motor]}
                    onChange={event => (strides.value = strides.value.with(motor, event.currentTarget.value as Stride))}
                >
                    {stridesOf(motor).map(([stride, title]) => (
                        <option key={stride} value={stride} selected={stride === strides.value[motor]}>
                            {title}
                        </option>
                    ))}
                </select>
                <span class="lamps">
                    <label title="Left stop switch (axis parameter 11)">
                        L
                        <Lamp
                            unknown={!motorKnown(motor, "flags")}
                            on={on("left")}
                            label="left switch"
                            tone={on("left_off") ? "off" : "warn"}
                        />
                    </label>
                    <label title="Right stop switch (axis parameter 10)">
                        R
                        <Lamp
                            unknown={!motorKnown(motor, "flags")}
                            on={on("right")}
                            label="right switch"
                            tone={on("right_off") ? "off" : "warn"}
                        />
                    </label>
                </span>
            </header>
            <Dial motor={motor} />
            <div class="figures" role="group" aria-label="Figures">
                <div class="big">
                    <span class="label">position</span>
                    <span class="figure" data-figure="position">
                        {position}
                    </span>
                </div>
                <div>
                    <span class="label">target</span>
                    <span class={`figure ${mode.value === 0 ? "" : "muted"}`} data-figure="target">
                        {target}
                    </span>
                </div>
                <div>
                    <span class="label">speed</span>
                    <span class="figure" data-figure="speed">
                        {speed}
                    </span>
                </div>
                <div class="unit">{unit}</div>
                {drivers && (
                    <div class="meters">
                        <span title="Load value of the driver, 0 to 7 (axis parameter 206)">
                            load{" "}
                            <Bar value={load.value} top={7} tone={still.value ? "load idle" : "load"} label="load" />{" "}
                            <b>{motorKnown(motor, "load") ? load : UNKNOWN}</b>
                        </span>
                        <span title="Coil current now">
                            {!motorKnown(motor, "current")
                                ? UNKNOWN
                                : top
                                  ? `${Math.round((current.value / 255) * top)} mA`
                                  : "current"}{" "}
                            <Bar value={current.value} top={255} tone="current" label="current" />
                        </span>
                    </div>
                )}
                {errors.value > 0 && (
                    <div class="errors">{ERRORS.filter((_, bit) => errors.value & (1 << bit)).join(", ")}</div>
                )}
            </div>
            <Rail motor={motor} />
            <footer>
                <Jog motor={motor} direction={-1} />
                <LocalNumber
                    class="speed"
                    value={jogSpeed.value[motor]!}
                    low={0}
                    high={2047}
                    label={`Jog speed of motor ${motor}`}
                    onInput={value => (jogSpeed.value = jogSpeed.value.with(motor, value))}
                />
                <Jog motor={motor} direction={1} />
                <button
                    class="stop"
                    disabled={!online.value}
                    title={`Stop motor ${motor} along its ramp (Alt+${motor + 1})`}
                    aria-label={`Stop motor ${motor}`}
                    onClick={() => send("MST", 0, motor)}
                >
                    <Icon name="stop" />
                </button>
                <span class="gap" />
                <LocalNumber
                    class="to"
                    value={moveTo.value[motor]!}
                    low={-8388608}
                    high={8388607}
                    label={`Destination of motor ${motor}`}
                    onInput={value => (moveTo.value = moveTo.value.with(motor, value))}
                />
                <button
                    disabled={!ready.value || goal === null}
                    title={notReady.value || "Move to this position"}
                    aria-label={`Move motor ${motor} to`}
                    onClick={() => goal !== null && send("MVP", 0, motor, goal)}
                >
                    to
                </button>
                <button
                    disabled={!ready.value || goal === null}
                    title={notReady.value || "Move by this distance from where the motor is"}
                    aria-label={`Move motor ${motor} by`}
                    onClick={() => goal !== null && send("MVP", 1, motor, goal)}
                >
                    by
                </button>
                <span class="space" />
                <button
                    disabled={!ready.value}
                    title={notReady.value || "Stop, and call this place zero"}
                    aria-label={`=0: zero motor ${motor}`}
                    onClick={() => ask({ call: "zero", motor })}
                >
                    =0
                </button>
                <button
                    class={search.value ? "active" : ""}
                    disabled={!(search.value ? online : ready).value}
                    aria-label={`Reference search of motor ${motor}`}
                    title={search.value ? "Abort the reference search" : notReady.value || "Start the reference search"}
                    onClick={() => (search.value ? endSearch(motor) : ask({ call: "search", motor }))}
                >
                    <Icon name="home" />
                </button>
            </footer>
        </section>
    );
}

/** Ask the module for what keeps a motor still, and show it. */
async function askWhy(motor: number): Promise<void> {
    const found = await ask({ call: "why", motor });
    if (!found) return;
    const lines = [...found.reasons, ...found.unknown.map(text => `Not known: ${text}`)];
    await choose(
        `Why motor ${motor} does not turn`,
        lines.length ? lines.join("\n\n") : "Nothing blocks it: no move was commanded, or it is turning.",
        [],
    );
}

function endSearch(motor: number): Promise<unknown> {
    const own = motionOf("search", motor);
    return own ? abort(own.number) : send("RFS", 1, motor);
}

export function Axes() {
    if (!welcome.value)
        return (
            <Empty icon="plug" title="No module yet">
                Waiting for the IDE's server.
            </Empty>
        );
    return (
        <div class="axes">
            {[0, 1, 2].map(motor => (
                <Axis key={motor} motor={motor} />
            ))}
        </div>
    );
}
