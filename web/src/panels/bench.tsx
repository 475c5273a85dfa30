// The bench around a virtual module: what a hand would do with switches, shafts, wires and the power supply.
import { computed } from "@preact/signals";
import { board, can, flag, motors, plugged, powered, timePaused, time, welcome, world, ask } from "../logic/app";
import type { SetBench } from "../wire";
import { Empty, IconButton, Lamp, Switch } from "../widgets/basics";
import { NumberField } from "../widgets/fields";
import { Icon } from "../widgets/icons";
import { remembered } from "../logic/settings";
import { grouped, short } from "../logic/units";
import { WhoWroteOf } from "./past";
import { offline, unless } from "../logic/hindrance";

const set = (what: SetBench["what"], index: number, value: number, fault = "") =>
    ask({ call: "set_bench", what, index, value, fault });

export const SPEEDS = [
    [0.01, "1/100"],
    [0.1, "1/10"],
    [0.25, "1/4"],
    [1, "1×"],
    [4, "4×"],
    [10, "10×"],
    [100, "100×"],
    [0, "max"],
] as const;

const LINES = [0, 1, 2, 3, 4, 5, 6, 7];
const askedSpeed = computed(() => time.value.asked);

export function TimeControls() {
    if (!can.value.bench) return null;
    const asked = askedSpeed.value;
    const speed = (value: number) => ask({ call: "set_time", speed: value });
    const listed = SPEEDS.some(([value]) => Math.abs(value - asked) < 1e-6);
    return (
        <span class="time-controls">
            <IconButton
                icon={timePaused.value ? "play" : "pause"}
                pressed={timePaused.value}
                label="Hold time"
                hindrance={offline.value}
                title="Hold time: module and bench stand still (Ctrl+F9)"
                onClick={() => ask({ call: "set_time", paused: !timePaused.value })}
            />
            <button
                class="tool text"
                {...unless(offline.value, "Advance time by one millisecond, then hold (Ctrl+F10)")}
                aria-label="+1 ms: one millisecond"
                onClick={() => ask({ call: "step_time", ms: 1 })}
            >
                +1 ms
            </button>
            <select
                aria-label="Speed of time"
                {...unless(offline.value, "Virtual seconds per second")}
                value={String(asked)}
                onChange={event => speed(Number(event.currentTarget.value))}
            >
                {!listed && <option value={String(asked)}>{short(asked)}×</option>}
                {SPEEDS.map(([value, text]) => (
                    <option key={value} value={String(value)} selected={Math.abs(value - asked) < 1e-6}>
                        {text}
                    </option>
                ))}
            </select>
        </span>
    );
}

/** A switch that a finger closes and lets go again, wherever the axis's own switch stands. */
export function StopSwitch({ motor, side }: { motor: number; side: "left" | "right" }) {
    const held = world.value?.axes[motor]?.[side === "left" ? "left_held" : "right_held"] ?? false;
    const closed = flag(motor, side);
    const off = flag(motor, side === "left" ? "left_off" : "right_off");
    return (
        <button
            class={`stop-switch ${closed ? "closed" : ""} ${held ? "held" : ""}`}
            aria-pressed={closed}
            aria-label={`${side} switch of motor ${motor}`}
            title={`${held ? "Release" : "Close"} the ${side} switch of motor ${motor}${off ? " (disabled: it does not stop the motor)" : ""}`}
            onClick={() => set(side, motor, held ? 0 : 1)}
        >
            <svg width="34" height="20" viewBox="0 0 34 20" aria-hidden="true">
                <circle cx="5" cy="14" r="2.500" />
                <circle cx="29" cy="14" r="2.500" />
                <path d={closed ? "M7.500 14H26.500" : "M7.300 13 25 5"} />
            </svg>
            <span>
                {side}
                {off ? " · off" : ""}
            </span>
        </button>
    );
}

/** A hand on the shaft. */
export function Drag({ motor }: { motor: number }) {
    const percent = Math.round((world.value?.axes[motor]?.load ?? 0) * 100);
    const drag = (value: number) => set("load", motor, value / 100);
    return (
        <div class="slider" title="Torque of a hand on the shaft, in parts of the motor's holding torque">
            <span>
                drag <b>{grouped(percent)}</b> %
                {percent !== 0 && (
                    <>
                        {" "}
                        ·{" "}
                        <button class="link" onClick={() => drag(0)}>
                            release
                        </button>
                    </>
                )}
            </span>
            <input
                class="centred"
                type="range"
                min="-150"
                max="150"
                step="5"
                value={percent}
                aria-label={`Load of motor ${motor}`}
                onDblClick={() => drag(0)}
                onInput={event => drag(Number(event.currentTarget.value))}
            />
        </div>
    );
}

const faultsOpen = remembered("faults", false);

function AxisBench({ motor }: { motor: number }) {
    const axis = world.value?.axes[motor];
    if (!axis) return null;
    const slip = motors[motor]!.value.slip;
    const { faults } = world.value!;
    return (
        <section class={`bench-axis motor${motor}`} aria-label={`Bench of motor ${motor}`}>
            <h4>
                <span class="name">Motor {motor}</span>
                <span class="muted">{axis.motor}</span>
                {slip !== 0 && <span class="bad">{Math.abs(slip)} full steps lost</span>}
                <span class="gap" />
                {faults.length > 0 && (
                    <button
                        class={`chip ${axis.faults.length ? "bad" : ""}`}
                        aria-expanded={faultsOpen.value}
                        aria-label={`Faults of motor ${motor}`}
                        title="Simulate faults of the motor driver"
                        onClick={() => (faultsOpen.value = !faultsOpen.value)}
                    >
                        {axis.faults.map(name => name.replace(/_/g, " ")).join(", ") || "faults"}{" "}
                        <Icon name={faultsOpen.value ? "up" : "down"} size={10} />
                    </button>
                )}
            </h4>
            <div class="row">
                <StopSwitch motor={motor} side="left" />
                <Drag motor={motor} />
                <StopSwitch motor={motor} side="right" />
            </div>
            {faultsOpen.value && faults.length > 0 && (
                <div class="faults" role="group" aria-label={`Driver faults of motor ${motor}`}>
                    {faults.map(({ name, meaning }) => {
                        const on = axis.faults.includes(name);
                        return (
                            <button
                                key={name}
                                class={`fault ${on ? "on" : ""}`}
                                aria-pressed={on}
                                title={meaning}
                                onClick={() => set("fault", motor, on ? 0 : 1, name)}
                            >
                                {name.replace(/_/g, " ")}
                            </button>
                        );
                    })}
                </div>
            )}
        </section>
    );
}

export function Bench() {
    if (!welcome.value)
        return (
            <Empty icon="plug" title="No module yet">
                Waiting for the IDE's server.
            </Empty>
        );
    if (!can.value.bench)
        return (
            <Empty icon="plug" title="This is a real module">
                A bench with switches, loads and inputs to click comes with a virtual module: start{" "}
                <code>tmcm34x ide</code> without <code>--port</code>.
            </Empty>
        );
    const state = board.value;
    const analog = (n: number) => state[`analog${n}` as "analog0"];
    return (
        <div class="bench">
            <section class="supply">
                <button
                    class={`wide ${powered.value ? "on" : "off"}`}
                    aria-pressed={powered.value}
                    title={powered.value ? "Switch the supply off" : "Switch the supply on"}
                    onClick={() => set("power", 0, powered.value ? 0 : 1)}
                >
                    <Icon name="power" /> {powered.value ? "Power on" : "Power off"}
                </button>
                <button
                    class={`wide ${plugged.value ? "" : "off"}`}
                    aria-pressed={!plugged.value}
                    title={plugged.value ? "Unplug the line between host and module" : "Plug the line in again"}
                    onClick={() => set("line", 0, plugged.value ? 0 : 1)}
                >
                    <Icon name="plug" /> {plugged.value ? "Line plugged" : "Line unplugged"}
                </button>
                <label
                    class="wide"
                    title={`SHUTDOWN pin ${welcome.value.model.shutdown_pin}; parameter 80 says what it does`}
                >
                    <Switch
                        label="SHUTDOWN pin"
                        on={state.shutdown !== 0}
                        onChange={on => set("shutdown", 0, on ? 1 : 0)}
                    />{" "}
                    SHUTDOWN
                </label>
            </section>
            {[0, 1, 2].map(motor => (
                <AxisBench key={motor} motor={motor} />
            ))}
            <section class="lines">
                <h4>
                    Inputs <span class="muted">each is digital and analogue at once</span>
                    <WhoWroteOf of="an input" values={LINES.map(n => `in[${n}]`)} />
                </h4>
                <div class="inputs">
                    {LINES.map(n => (
                        <div class="input" key={n}>
                            {world.value?.inputs.includes(n) ? (
                                <IconButton
                                    icon="undo"
                                    size={11}
                                    class="number-label"
                                    label={`Give input ${n} back to the bench`}
                                    title="Held by hand; a click gives it back to the bench"
                                    onClick={() => set("source", n, 0)}
                                />
                            ) : (
                                <span class="number-label">{n}</span>
                            )}
                            <Switch
                                label={`Input ${n}`}
                                on={((state.inputs >> n) & 1) === 1}
                                onChange={on => set("input", n, on ? 1 : 0)}
                            />
                            <input
                                type="range"
                                min="0"
                                max="1023"
                                value={analog(n)}
                                aria-label={`Level of input ${n}`}
                                onInput={event => set("analog", n, Number(event.currentTarget.value))}
                            />
                            <NumberField
                                width={48}
                                label={`Value of input ${n}`}
                                value={analog(n)}
                                low={0}
                                high={1023}
                                onCommit={value => set("analog", n, value)}
                            />
                        </div>
                    ))}
                </div>
                <h4>
                    Outputs <WhoWroteOf of="an output" values={LINES.map(n => `out[${n}]`)} />
                </h4>
                <div class="outputs">
                    {LINES.map(n => (
                        <span class="output" key={n} title={`Output ${n}`}>
                            <Lamp on={((state.outputs >> n) & 1) === 1} label={`output ${n}`} /> {n}
                        </span>
                    ))}
                </div>
            </section>
            <p class="muted note">Bench: {world.value?.bench}</p>
        </div>
    );
}
