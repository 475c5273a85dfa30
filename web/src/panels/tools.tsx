// Tools of the trade: reference search, stall detection, units, configuration, firmware.
import { signal, useComputed, useSignal } from "@preact/signals";
import { useEffect, useRef } from "preact/hooks";
import {
    ask, axisParameter, can, clockSeconds, execute, flag, motors, notify, online, readAxis, send, setAxis, tables, welcome,
} from "../logic/app";
import { parameters, refresh } from "../logic/parameters";
import { remembered } from "../logic/settings";
import {
    accelerationOfSlope, fullstepRate, grouped, rampSeconds, rate, rateSlope, rpm, short, turns, ustepsPerTurn, velocityOfRpm, type Scale,
} from "../logic/units";
import { Choice, Empty, NumberField, offer } from "../widgets/basics";
import { Icon } from "../widgets/icons";
import { FULLSTEPS } from "./axes";
import { Drag, StopSwitch } from "./bench";
import { insertIntoEditor } from "./direct";
import { want } from "./program";

const tool = remembered<keyof typeof TOOLS>("tool", "units");
const motor = remembered("tool-motor", 0);
const TOOLS = {
    units: "Unit calculator", reference: "Reference search", stall: "Stall detection", profile: "Load profile",
    configuration: "Module configuration", firmware: "Firmware and reset",
} as const;

const MotorChoice = () => (
    <Choice label="Motor" value={motor.value} options={[[0, "Motor 0"], [1, "Motor 1"], [2, "Motor 2"]] as const} onChange={(value) => (motor.value = value)} />
);
const valueOf = (key: string): number => parameters.value.axis.get(axisParameter(key).number)?.[motor.value] ?? axisParameter(key).default;

/** Lines to copy into a program. */
function Commands({ lines }: { lines: string[] }) {
    return (
        <div class="commands"><pre>{lines.join("\n")}</pre>
            <button onClick={() => lines.slice().reverse().forEach(insertIntoEditor)}><Icon name="copy" /> Copy to the editor</button></div>
    );
}

// ------------------------------------------------------------------ unit calculator
const steps = remembered("unit-fullsteps", FULLSTEPS);
const velocity = remembered("unit-velocity", 1000);
const acceleration = remembered("unit-acceleration", 500);
const way = remembered("unit-way", 12800);
const own = remembered<{ pulse: number; ramp: number; resolution: number } | null>("unit-own", null);

function Units() {
    want("axis");
    const divisors = own.value ?? { pulse: valueOf("pulse_divisor"), ramp: valueOf("ramp_divisor"), resolution: valueOf("microstep_resolution") };
    const scale: Scale = { clock_hz: tables.value.clock_hz, pulse_div: divisors.pulse, ramp_div: divisors.ramp, resolution: divisors.resolution, fullsteps_per_turn: steps.value };
    const set = (part: Partial<typeof divisors>) => (own.value = { ...divisors, ...part });
    const v = velocity.value;
    const a = acceleration.value;
    return (
        <div class="tool-body units">
            <div class="row"><MotorChoice />
                {own.value ? <button onClick={() => (own.value = null)}>Take the module's divisors</button> : <span class="muted">divisors as in the module</span>}</div>
            <div class="grid">
                <label>Full steps a turn<NumberField value={steps.value} low={1} high={100000} label="Full steps a turn" onCommit={(value) => (steps.value = value)} /></label>
                <label>Microstep resolution (140)<NumberField value={scale.resolution} low={0} high={6} label="Microstep resolution" onCommit={(resolution) => set({ resolution })} /></label>
                <label>Pulse divisor (154)<NumberField value={scale.pulse_div} low={0} high={13} label="Pulse divisor" onCommit={(pulse) => set({ pulse })} /></label>
                <label>Ramp divisor (153)<NumberField value={scale.ramp_div} low={0} high={13} label="Ramp divisor" onCommit={(ramp) => set({ ramp })} /></label>
            </div>
            <div class="columns">
                <section class="card"><h3>Speed</h3>
                    <label>velocity units<NumberField value={v} low={0} high={2047} label="Velocity" onCommit={(value) => (velocity.value = value)} /></label>
                    <label>turns a minute<NumberField whole={false} value={short(rpm(scale, v))} label="Turns a minute" low={0} high={1e6} onCommit={(value) => (velocity.value = Math.min(2047, velocityOfRpm(scale, value)))} /></label>
                    <dl><div><dt>turns a second</dt><dd>{short(rpm(scale, v) / 60)}</dd></div><div><dt>full steps a second</dt><dd>{short(fullstepRate(scale, v))}</dd></div>
                        <div><dt>microsteps a second</dt><dd>{grouped(rate(scale, v))}</dd></div><div><dt>one unit is</dt><dd>{short(rpm(scale, 1))} rpm</dd></div>
                        <div><dt>highest (2047)</dt><dd>{short(rpm(scale, 2047))} rpm</dd></div></dl></section>
                <section class="card"><h3>Acceleration</h3>
                    <label>acceleration units<NumberField value={a} low={0} high={2047} label="Acceleration" onCommit={(value) => (acceleration.value = value)} /></label>
                    <label>full steps/s²<NumberField whole={false} low={0} high={1e12} value={short(rateSlope(scale, a) / 2 ** scale.resolution)} label="Full steps a second squared"
                        onCommit={(value) => (acceleration.value = Math.min(2047, accelerationOfSlope(scale, value * 2 ** scale.resolution)))} /></label>
                    <dl><div><dt>turns/s²</dt><dd>{short(rateSlope(scale, a) / ustepsPerTurn(scale))}</dd></div><div><dt>time to speed {v}</dt><dd>{short(rampSeconds(scale, v, a))} s</dd></div>
                        <div><dt>turns until then</dt><dd>{short(turns(scale, (rate(scale, v) * rampSeconds(scale, v, a)) / 2))}</dd></div></dl></section>
                <section class="card"><h3>Way</h3>
                    <label>microsteps<NumberField value={way.value} low={-(2 ** 23)} high={2 ** 23 - 1} label="Microsteps" onCommit={(value) => (way.value = value)} /></label>
                    <label>turns<NumberField whole={false} value={short(turns(scale, way.value))} low={-1e6} high={1e6} label="Turns" onCommit={(value) => (way.value = Math.round(value * ustepsPerTurn(scale)))} /></label>
                    <dl><div><dt>degrees</dt><dd>{short(turns(scale, way.value) * 360)}</dd></div><div><dt>full steps</dt><dd>{short(way.value / 2 ** scale.resolution)}</dd></div><div><dt>microsteps a turn</dt><dd>{grouped(ustepsPerTurn(scale))}</dd></div><div><dt>whole range ±2²³</dt><dd>{short(turns(scale, 2 ** 24))} turns</dd></div></dl></section>
            </div>
            <Commands lines={[`SAP ${axisParameter("max_speed").number}, ${motor.value}, ${v}`, `SAP ${axisParameter("max_acceleration").number}, ${motor.value}, ${a}`,
                ...(own.value ? [`SAP ${axisParameter("pulse_divisor").number}, ${motor.value}, ${scale.pulse_div}`, `SAP ${axisParameter("ramp_divisor").number}, ${motor.value}, ${scale.ramp_div}`] : [])]} />
        </div>
    );
}

// ------------------------------------------------------------------ reference search
function Reference() {
    want("axis");
    const row = axisParameter("reference_mode");
    const mode = valueOf("reference_mode");
    const state = useComputed(() => motors[motor.value]!.value.search);
    const set = (key: string) => (value: number) => void setAxis(key, motor.value, value).then(refresh);
    const searching = state.value > 0;
    const texts: Record<number, string[]> = {
        1: ["left at search speed until the left switch closes", "right at switch speed until it opens", "left again until it closes", "zero in the middle of both places"],
        2: ["right at search speed until the right switch closes", "left at search speed until the left switch closes", "off it and on again at switch speed", "zero at the left switch; the way between the switches is parameter 196"],
        3: ["right at search speed until the right switch closes", "left to the reference switch, past it", "back onto it from the other side", "zero in its middle; the way is parameter 196"],
    };
    return (
        <div class="tool-body">
            <div class="row"><MotorChoice /></div>
            <div class="grid">
                <label>Mode (193)<select aria-label="Referencing mode" value={String(mode)} onChange={(event) => set("reference_mode")(Number(event.currentTarget.value))}>
                    {row.choices.map((choice) => <option key={choice.value} value={String(choice.value)} selected={choice.value === mode}>{choice.value} {choice.text}</option>)}</select></label>
                <label>Search speed (194)<NumberField value={valueOf("reference_search_speed")} low={0} high={2047} label="Search speed" onCommit={set("reference_search_speed")} /></label>
                <label>Switch speed (195)<NumberField value={valueOf("reference_switch_speed")} low={0} high={2047} label="Switch speed" onCommit={set("reference_switch_speed")} /></label>
            </div>
            <ol class="steps">{(texts[mode] ?? []).map((text) => <li key={text}>{text}</li>)}</ol>
            <div class="row">
                <button class="primary" disabled={!online.value} onClick={() => send("RFS", searching ? 1 : 0, motor.value)}>{searching ? "Abort the search" : "Start the search"}</button>
                <span class={`pill ${searching ? "warn" : ""}`}>{searching ? `searching, state ${state.value}` : "idle"}</span>
                {can.value.bench ? <><StopSwitch motor={motor.value} side="left" /><StopSwitch motor={motor.value} side="right" /></>
                    : (["left", "right"] as const).map((side) => <span key={side} class={`pill ${flag(motor.value, side) ? "good" : ""}`}>{side} {flag(motor.value, side) ? "closed" : "open"}</span>)}
                <span>position <b>{grouped(motors[motor.value]!.value.position)}</b></span>
                <span>way between switches <b>{grouped(valueOf("end_switch_distance"))}</b></span>
            </div>
            <Commands lines={[`SAP 193, ${motor.value}, ${mode}`, `SAP 194, ${motor.value}, ${valueOf("reference_search_speed")}`, `SAP 195, ${motor.value}, ${valueOf("reference_switch_speed")}`,
                `RFS START, ${motor.value}`, `WAIT RFS, ${motor.value}, 1000`]} />
        </div>
    );
}

// ------------------------------------------------------------------ stall detection
const stallSpeed = remembered("stall-speed", 500);

function Stall() {
    want("axis");
    const load = useComputed(() => motors[motor.value]!.value.load);
    if (!welcome.value!.model.max_current_ma) return <NoDrivers />;
    const threshold = valueOf("stall_threshold");
    const turn = (mnemonic: "ROR" | "ROL") => send(mnemonic, 0, motor.value, stallSpeed.value);
    return (
        <div class="tool-body">
            <div class="row"><MotorChoice /></div>
            <div class="grid">
                <label>Velocity<NumberField value={stallSpeed.value} low={0} high={2047} label="Velocity" onCommit={(value) => (stallSpeed.value = value)} /></label>
                <label>Acceleration (5)<NumberField value={valueOf("max_acceleration")} low={0} high={2047} label="Acceleration" onCommit={(value) => void setAxis("max_acceleration", motor.value, value).then(refresh)} /></label>
            </div>
            <div class="row">
                <button onClick={() => turn("ROL")}><Icon name="turnLeft" /> Rotate left</button>
                <button onClick={() => send("MST", 0, motor.value)}><Icon name="stop" /> Stop</button>
                <button onClick={() => turn("ROR")}><Icon name="turnRight" /> Rotate right</button>
                {flag(motor.value, "stalled") && <span class="pill bad">stalled</span>}
            </div>
            <div class="load-scale" role="meter" aria-label="Load" aria-valuenow={load.value} aria-valuemax={7}>
                {Array.from({ length: 8 }, (_, n) => <span key={n} class={`${n <= load.value && load.value > 0 ? "on" : ""} ${threshold && n >= threshold ? "over" : ""}`}>{n}</span>)}
            </div>
            <label class="threshold"><span>Stall detection threshold (205): <b>{threshold || "off"}</b></span>
                <input type="range" min="0" max="7" value={threshold} aria-label="Stall threshold" onInput={(event) => void setAxis("stall_threshold", motor.value, Number(event.currentTarget.value)).then(refresh)} /></label>
            {can.value.bench && <div class="threshold"><Drag motor={motor.value} /></div>}
            <p class="muted note">Turn the motor at its working speed, see which load it shows, load it by hand until it nearly stalls, and set the threshold between the two. The motor is stopped when the load reaches it, not while speeding up or slowing down.</p>
            <Commands lines={[`SAP 205, ${motor.value}, ${threshold}`]} />
        </div>
    );
}

const NoDrivers = () => <Empty icon="info" title="No load measurement">The drivers of a {welcome.value!.model.name} are outside, behind its step and direction outputs: it cannot tell their load.</Empty>;

// ------------------------------------------------------------------ load profile
const profileRange = remembered("profile", { low: 50, high: 1000, step: 50 });
interface Point { velocity: number; mean: number; deviation: number }
const profile = signal<Point[]>([]);
const profiling = signal(false);

const frame = () => new Promise((done) => requestAnimationFrame(done));
/** Waits in the module's time, so that a slow or fast virtual module is measured alike. */
async function pass(seconds: number): Promise<void> {
    const until = clockSeconds.value + seconds;
    const limit = performance.now() + seconds * 1000 * 50 + 20000;
    while (clockSeconds.value < until && profiling.value && performance.now() < limit) await frame();
}

async function measure(): Promise<void> {
    const { low, high, step } = profileRange.value;
    const which = motor.value;
    profiling.value = true;
    profile.value = [];
    for (let v = low; v <= high && profiling.value; v += step) {
        if ((await send("ROR", 0, which, v))?.status !== 100) break;
        await pass(0.05);
        const limit = performance.now() + 20000;
        while (motors[which]!.value.speed !== v && profiling.value && performance.now() < limit) await frame();
        const values: number[] = [];
        while (values.length < 10 && profiling.value) {
            await pass(0.02);
            const load = await readAxis("load_value", which);
            if (load === null) break;
            values.push(load);
        }
        if (values.length < 10) break;
        const mean = values.reduce((sum, value) => sum + value, 0) / values.length;
        const deviation = Math.sqrt(values.reduce((sum, value) => sum + (value - mean) ** 2, 0) / values.length);
        profile.value = [...profile.value, { velocity: v, mean, deviation }];
    }
    await send("MST", 0, which);
    profiling.value = false;
}

function Profile() {
    if (!welcome.value!.model.max_current_ma) return <NoDrivers />;
    const { low, high, step } = profileRange.value;
    const points = profile.value;
    const place = (value: number) => 40 + ((value - low) / Math.max(1, high - low)) * 640;
    const tone = (deviation: number) => (deviation < 0.4 ? "var(--good)" : deviation < 1 ? "var(--warn)" : "var(--bad)");
    const set = (part: Partial<typeof profileRange.value>) => (profileRange.value = { ...profileRange.value, ...part });
    return (
        <div class="tool-body">
            <div class="row"><MotorChoice /></div>
            <div class="grid">
                <label>From velocity<NumberField value={low} low={1} high={2047} label="From velocity" onCommit={(value) => set({ low: value })} /></label>
                <label>To velocity<NumberField value={high} low={1} high={2047} label="To velocity" onCommit={(value) => set({ high: value })} /></label>
                <label>Step<NumberField value={step} low={1} high={500} label="Step" onCommit={(value) => set({ step: value })} /></label>
            </div>
            <div class="row">
                <button class="primary" disabled={!online.value} onClick={() => (profiling.value ? (profiling.value = false) : void measure())}>{profiling.value ? "Abort" : "Measure"}</button>
                {points.length > 0 && <button onClick={() => offer("load-profile.csv", ["velocity,mean_load,deviation", ...points.map((point) => `${point.velocity},${point.mean.toFixed(2)},${point.deviation.toFixed(3)}`)].join("\n") + "\n")}><Icon name="save" /> Export CSV</button>}
                <span class="muted">ten samples at each velocity; green is steady, red is not</span>
            </div>
            <svg class="profile-chart" viewBox="0 0 700 230" role="img" aria-label="Load over velocity">
                {[0, 1, 2, 3, 4, 5, 6, 7].map((n) => <g key={n}><path class="grid" d={`M40 ${200 - n * 25}H690`} /><text x="30" y={204 - n * 25} text-anchor="end">{n}</text></g>)}
                {points.map((point) => <g key={point.velocity} stroke={tone(point.deviation)} fill={tone(point.deviation)}>
                    <path d={`M${place(point.velocity)} ${200 - (point.mean - point.deviation) * 25}V${200 - (point.mean + point.deviation) * 25}`} stroke-width="2" />
                    <circle cx={place(point.velocity)} cy={200 - point.mean * 25} r="4" /></g>)}
                <text x="40" y="222">{low}</text><text x="680" y="222" text-anchor="end">{high} velocity units</text>
            </svg>
        </div>
    );
}

// ------------------------------------------------------------------ configuration
const CONFIGURATION = [
    ["Serial line", ["serial_address", "host_address", "baud_rate", "telegram_pause", "serial_heartbeat", "ascii_mode"]],
    ["CAN", ["can_bit_rate", "can_id", "can_reply_id", "can_secondary_id"]],
    ["Start and protection", ["auto_start", "code_protection", "eeprom_lock", "shutdown_pin", "encoder_interface", "coordinate_storage", "keep_user_variables_cleared"]],
] as const;

function Configuration() {
    want("globals");
    const value = (bank: number, number: number) => parameters.value.globals.get(`${bank}/${number}`);
    return (
        <div class="tool-body columns">
            {CONFIGURATION.map(([title, keys]) => (
                <section class="card" key={title}><h3>{title}</h3>
                    {keys.map((key) => {
                        const row = tables.value.globals.find((item) => item.key === key);
                        if (!row) return null;
                        const now = value(row.bank, row.number);
                        const set = (next: number) => void send("SGP", row.number, row.bank, next).then(refresh);
                        if (key === "eeprom_lock")
                            return (
                                <label key={key} title={row.meaning}>{row.name} ({row.number})<span class="row">
                                    <span class={`pill ${now ? "warn" : "good"}`}>{now ? "locked" : "unlocked"}</span>
                                    <button onClick={() => set(now ? 4321 : 1234)}>{now ? "Unlock" : "Lock"}</button></span></label>
                            );
                        return (
                            <label key={key} title={row.meaning}>{row.name} ({row.number})
                                {now == null ? <span class="muted">–</span> : row.choices.length
                                    ? <select value={String(now)} onChange={(event) => set(Number(event.currentTarget.value))}>{row.choices.map((choice) => <option key={choice.value} value={String(choice.value)} selected={choice.value === now}>{choice.text}</option>)}</select>
                                    : <NumberField value={now} low={row.low} high={row.high} label={row.name} onCommit={set} />}
                            </label>
                        );
                    })}
                </section>
            ))}
            <p class="muted note">Each change is stored in the EEPROM at once. A new address or baud rate holds from the next command on.</p>
        </div>
    );
}

// ------------------------------------------------------------------ firmware
function Firmware() {
    const binary = useSignal<number | null>(null);
    const sure = useSignal("");
    const asked = useRef(false);
    useEffect(() => {
        if (asked.current) return;
        asked.current = true;
        void execute({ number: 136, type: 1 }).then((exchange) => (binary.value = exchange?.status === 100 ? exchange.value : null));
    }, []);
    const model = welcome.value!.model;
    const value = binary.value;
    const reset = async () => {
        await ask({ call: "execute", number: 137, value: 1234 });
        sure.value = "";
        notify("information", "The module has its factory settings again. The program in it is kept.");
        await refresh();
    };
    return (
        <div class="tool-body columns">
            <section class="card"><h3>Firmware</h3>
                <dl><div><dt>module</dt><dd>{model.name}</dd></div><div><dt>version</dt><dd>{model.version}</dd></div>
                    <div><dt>as the module tells it</dt><dd>{value === null ? "no answer" : `${value >> 16} V${(value >> 8) & 255}.${value & 255}`}</dd></div>
                    <div><dt>where</dt><dd>{welcome.value!.source}: {welcome.value!.module}</dd></div>
                    <div><dt>largest current</dt><dd>{model.max_current_ma ? `${model.max_current_ma} mA` : "set at the driver"}</dd></div>
                    <div><dt>IDE</dt><dd>{welcome.value!.product}</dd></div></dl></section>
            <section class="card danger"><h3>Factory settings</h3>
                <p>All stored axis and global parameters go back to their defaults, addresses and baud rate too. The module restarts; the program in it stays.</p>
                <label>To be sure, type <b>reset</b><input value={sure.value} onInput={(event) => (sure.value = event.currentTarget.value)} /></label>
                <button class="danger" disabled={sure.value !== "reset" || !online.value} onClick={reset}>Restore factory settings</button></section>
        </div>
    );
}

export function Tools() {
    const views = { units: Units, reference: Reference, stall: Stall, profile: Profile, configuration: Configuration, firmware: Firmware };
    const View = views[tool.value];
    return (
        <div class="page tools">
            <nav aria-label="Tools">{Object.entries(TOOLS).map(([id, title]) => (
                <button key={id} class={tool.value === id ? "on" : ""} onClick={() => (tool.value = id as keyof typeof TOOLS)}>{title}</button>))}</nav>
            <div class="scroll"><h2>{TOOLS[tool.value]}</h2><View key={tool.value} /></div>
        </div>
    );
}
