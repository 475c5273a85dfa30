// One axis: what its motor does, and everything to move it by hand.
import { useComputed } from "@preact/signals";
import { abort, motionOf, notReady } from "../../logic/authority";
import { ask, axisParameter, figures, motorKnown, motors, reachable, send, stale, welcome } from "../../logic/app";
import { choose } from "../../logic/confirm";
import { placeOf, scaleOf, unitsOf } from "../../logic/scales";
import { FULL_CURRENT, grouped, rate, rpm, short } from "../../logic/units";
import { Lamp } from "../../widgets/basics";
import { Dial } from "../../widgets/dial";
import { LocalNumber } from "../../widgets/fields";
import { Icon } from "../../widgets/icons";
import { MOTOR_FLAGS } from "../../wire";
import { Jog } from "./jog";
import { Rail } from "./rail";
import { stateOf } from "./state";
import { jogSpeed, moveTo, strides, stridesOf, type Stride } from "./strides";
import { offline, unless } from "../../logic/hindrance";

function Bar({ value, top, tone, label }: { value: number; top: number; tone: string; label: string }) {
    return (
        <span class={`bar ${tone}`} role="meter" aria-label={label} aria-valuenow={value} aria-valuemax={top}>
            <span style={{ width: `${Math.min(100, (value / top) * 100)}%` }} />
        </span>
    );
}
const UNKNOWN = "\u2013";

const isOn = (motor: number, name: keyof typeof MOTOR_FLAGS) => (motors[motor]!.value.flags & MOTOR_FLAGS[name]) !== 0;

function Header({ motor }: { motor: number }) {
    const words = useComputed(() => stateOf(motor));
    const still = useComputed(() => motors[motor]!.value.speed === 0);
    const bad = useComputed(
        () => isOn(motor, "stalled") || motors[motor]!.value.slip !== 0 || errorsOf(motor).length > 0,
    );
    const state = words.value;
    return (
        <header>
            <span class="name">Motor {motor}</span>
            <span class={`state ${bad.value ? "bad" : state === "at target" ? "good" : ""}`} title={state}>
                {state}
            </span>
            {still.value && (
                <button
                    class="link"
                    {...unless(
                        !reachable.value && "The module cannot be reached",
                        "Ask the module why this motor does not turn",
                    )}
                    onClick={() => void askWhy(motor)}
                >
                    why?
                </button>
            )}
            <span class="lamps">
                <SwitchLamp motor={motor} side="left" />
                <SwitchLamp motor={motor} side="right" />
            </span>
        </header>
    );
}

function SwitchLamp({ motor, side }: { motor: number; side: "left" | "right" }) {
    const shown = useComputed(() => [isOn(motor, side), isOn(motor, `${side}_off`)] as const);
    const [on, off] = shown.value;
    const { name, number } = axisParameter(`${side}_switch`);
    return (
        <label title={`${name} (axis parameter ${number})`}>
            {side === "left" ? "L" : "R"}
            <Lamp unknown={!motorKnown(motor, "flags")} on={on} label={`${side} switch`} tone={off ? "off" : "warn"} />
        </label>
    );
}

/** The errors of the motor's driver, by the names of the table. */
function errorsOf(motor: number): string[] {
    const { errors } = motors[motor]!.value;
    return errors ? (axisParameter("driver_error_flags")?.bits ?? []).filter((_, bit) => errors & (1 << bit)) : [];
}

function Figures({ motor }: { motor: number }) {
    const shown = (name: "position" | "target" | "speed") =>
        useComputed(() => (motorKnown(motor, name) ? grouped(figures[motor]!.value[name]) : UNKNOWN));
    const [position, target, speed] = [shown("position"), shown("target"), shown("speed")];
    const scaled = (text: (scale: ReturnType<typeof scaleOf>) => string) =>
        useComputed(() =>
            (["speed", "resolution", "pulse_div", "ramp_div"] as const).every(name => motorKnown(motor, name))
                ? text(scaleOf(motor))
                : UNKNOWN,
        );
    const place = scaled(() => placeOf(motor, figures[motor]!.value.position));
    const goal = scaled(() => placeOf(motor, figures[motor]!.value.target));
    const turning = scaled(scale => `${short(rpm(scale, figures[motor]!.value.speed))} rpm`);
    const steps = scaled(scale => `${short(rate(scale, figures[motor]!.value.speed) / 1000)} k\u00b5steps/s`);
    const mode = useComputed(() => (motorKnown(motor, "mode") ? motors[motor]!.value.mode : 0));
    const errors = useComputed(() => errorsOf(motor).join(", "));
    return (
        <div class="figures" role="group" aria-label="Figures">
            <span class="label">position</span>
            <span class="figure big" data-figure="position">
                {position}
            </span>
            <span class="unit">{place}</span>
            <span class="label">target</span>
            <span class={`figure ${mode.value === 0 ? "" : "unused"}`} data-figure="target">
                {target}
            </span>
            <span class="unit">{mode.value === 0 && goal}</span>
            <span class="label">speed</span>
            <span class="figure" data-figure="speed">
                {speed}
            </span>
            <span class="unit" data-figure="turning" title={steps.value}>
                {turning}
            </span>
            {errors.value ? (
                <span class="errors" title={errors.value}>
                    {errors}
                </span>
            ) : (
                welcome.value?.model.drivers && <Meters motor={motor} />
            )}
        </div>
    );
}

/** In mA where the largest current is known. */
const currentText = (setting: number, top: number | null): string =>
    top === null ? `${setting}/${FULL_CURRENT}` : `${Math.round((setting / FULL_CURRENT) * top)} mA`;

function Meters({ motor }: { motor: number }) {
    const load = useComputed(() => motors[motor]!.value.load);
    const current = useComputed(() => motors[motor]!.value.current);
    const still = useComputed(() => motors[motor]!.value.speed === 0);
    const row = axisParameter("load_value");
    const top = welcome.value?.model.max_current_ma ?? null;
    return (
        <>
            <span class="label" title={`${row.meaning} (axis parameter ${row.number})`}>
                load
            </span>
            <span class="meter">
                <Bar value={load.value} top={row.high} tone={still.value ? "load idle" : "load"} label="load" />
                <b>{motorKnown(motor, "load") ? load : UNKNOWN}</b>
            </span>
            <span class="meter unit" title="Coil current now">
                <Bar value={current.value} top={FULL_CURRENT} tone="current" label="current" />
                {motorKnown(motor, "current") ? currentText(current.value, top) : UNKNOWN}
            </span>
        </>
    );
}

function StrideChoice({ motor }: { motor: number }) {
    return (
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
    );
}

function Footer({ motor }: { motor: number }) {
    const goal = moveTo.value[motor] ?? null;
    const noGoal = goal === null && "Type a position or a distance first";
    const speed = axisParameter("max_speed");
    const place = axisParameter("target_position");
    return (
        <footer>
            <Jog motor={motor} direction={-1} />
            <StrideChoice motor={motor} />
            <LocalNumber
                class="speed"
                units={unitsOf(speed, motor)}
                value={jogSpeed.value[motor]!}
                low={speed.low}
                high={speed.high}
                hindrance={strides.value[motor] !== "hold" && "Steps are made at the maximum positioning speed"}
                label={`Jog speed of motor ${motor}`}
                onInput={value => (jogSpeed.value = jogSpeed.value.with(motor, value))}
            />
            <Jog motor={motor} direction={1} />
            <button
                class="stop"
                {...unless(offline.value, `Stop motor ${motor} along its ramp (Alt+${motor + 1})`)}
                aria-label={`Stop motor ${motor}`}
                onClick={() => send("MST", 0, motor)}
            >
                <Icon name="stop" />
            </button>
            <span class="gap" />
            <button
                {...unless(notReady.value || noGoal, "Move to this position")}
                aria-label={`Move motor ${motor} to`}
                onClick={() => goal !== null && send("MVP", 0, motor, goal)}
            >
                to
            </button>
            <LocalNumber
                class="to"
                units={unitsOf(place, motor)}
                value={moveTo.value[motor]!}
                low={place.low}
                high={place.high}
                label={`Destination of motor ${motor}`}
                onInput={value => (moveTo.value = moveTo.value.with(motor, value))}
            />
            <button
                {...unless(notReady.value || noGoal, "Move by this distance from where the motor is")}
                aria-label={`Move motor ${motor} by`}
                onClick={() => goal !== null && send("MVP", 1, motor, goal)}
            >
                by
            </button>
        </footer>
    );
}

/** What changes the place that is called zero: away from what moves. */
function Reference({ motor }: { motor: number }) {
    const search = useComputed(() => motors[motor]!.value.search > 0);
    return (
        <div class="reference">
            <button
                {...unless(notReady.value, "Stop, and call this place zero")}
                aria-label={`=0: zero motor ${motor}`}
                onClick={() => ask({ call: "zero", motor })}
            >
                =0
            </button>
            <button
                class={search.value ? "active" : ""}
                aria-label={`Reference search of motor ${motor}`}
                {...(search.value
                    ? unless(offline.value, "Abort the reference search")
                    : unless(notReady.value, "Start the reference search"))}
                onClick={() => (search.value ? endSearch(motor) : ask({ call: "search", motor }))}
            >
                <Icon name="home" />
            </button>
        </div>
    );
}

export function AxisCard({ motor }: { motor: number }) {
    return (
        <section class={`axis motor${motor} ${stale.value ? "stale" : ""}`} aria-label={`Motor ${motor}`}>
            <Header motor={motor} />
            <Dial motor={motor} />
            <Figures motor={motor} />
            <Reference motor={motor} />
            <Rail motor={motor} />
            <Footer motor={motor} />
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
