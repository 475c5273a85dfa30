// The debugger's view of the running program: registers, flags, stack, variables, breakpoints.
import { signal, useSignal } from "@preact/signals";
import { useEffect } from "preact/hooks";
import { PROGRAM_FLAGS } from "../wire";
import {
    can,
    foreign,
    halted,
    held,
    loaded,
    online,
    program,
    programKnown,
    send,
    shownProgram,
    stale,
    tables,
} from "../logic/app";
import {
    assign,
    breakpoints,
    breaks,
    chooseBreak,
    chosenBreaks,
    evaluate,
    hitsOf,
    placeOf,
    readStack,
    setBreakpoints,
    stopReason,
    type Breakpoint,
    type Frame,
} from "../logic/debugger";
import { remembered } from "../logic/settings";
import { openFile } from "../logic/documents";
import { keyOf, parameters, refresh, touched, wanted } from "../logic/parameters";
import { ActionButton, Empty, IconButton } from "../widgets/basics";
import { NumberField } from "../widgets/fields";
import { DataBreakpoints } from "./data-breakpoints";
import { WhoWrote } from "./past";
import { unread } from "../logic/hindrance";

const frames = signal<Frame[]>([]);
const FLAG_NAMES: Record<string, string> = {
    zero: "ZE",
    equal: "EQ",
    lower: "LT",
    greater: "GT",
    eto: "ETO",
    eal: "EAL",
    edv: "EDV",
    epo: "EPO",
    esd: "ESD",
};
const STATES = ["stopped", "running", "stepping", "reset"];
const FIRST_VARIABLES = 16;

export const programText = (): string =>
    stale.value || !programKnown("state") ? "unknown" : held.value ? "held" : (STATES[shownProgram.value.state] ?? "?");

export function want(section: "axis" | "globals" | "variables" | "coordinates"): void {
    useEffect(() => {
        wanted.value = new Set([...wanted.peek(), section]);
        return () => {
            wanted.value = new Set([...wanted.peek()].filter(other => other !== section));
        };
    }, []);
}

export function Program() {
    want("variables");
    const many = useSignal(false);
    const { counter, depth, paused, state, flags, accumulator, x } = program.value;
    useEffect(() => {
        if (!can.value.debug || !depth) frames.value = [];
        else if (halted.value) void readStack().then(list => (frames.value = list));
    }, [counter, depth, paused, state]);
    const line = loaded.value?.lines[counter];
    const variables = tables.value.globals
        .filter(row => row.bank === 2)
        .slice(0, many.value ? undefined : FIRST_VARIABLES);
    return (
        <div class="program">
            <div class="buttons">
                <ActionButton id="run" />
                <ActionButton id="pause" />
                <ActionButton id="step" />
                <ActionButton id="step_over" />
                <ActionButton id="step_out" />
                <ActionButton id="step_back" />
                <ActionButton id="reverse" />
                <ActionButton id="stop" />
                <ActionButton id="reset" />
                <ActionButton id="follow" />
                <span class={`pill ${paused ? "warn" : state === 1 ? "good" : ""}`}>
                    {programText()}
                    {paused && stopReason.value ? `: ${stopReason.value}` : ""}
                </span>
            </div>
            <h4>Next instruction</h4>
            <div class="next">
                <b>{counter}</b>{" "}
                {line ? (
                    <button class="link mono" onClick={() => line.line && openFile(line.path, line.line)}>
                        {line.text}
                    </button>
                ) : (
                    <span class="muted">
                        {foreign.value
                            ? "another program, which the module held then"
                            : loaded.value
                              ? "outside the program"
                              : "this IDE did not load the program in the module"}
                    </span>
                )}
            </div>
            <h4>Watches</h4>
            <Watches />
            {can.value.debug && (
                <>
                    <h4>Registers</h4>
                    <dl class="registers">
                        <Register name="accumulator" title="accumulator" value={accumulator} />
                        <Register name="x" title="X" value={x} />
                    </dl>
                    <div class="flags">
                        {Object.entries(FLAG_NAMES).map(([name, text]) => (
                            <button
                                key={name}
                                class={flags & PROGRAM_FLAGS[name as "zero"] ? "on" : ""}
                                title={`Flag ${text}; a click changes it`}
                                aria-pressed={(flags & PROGRAM_FLAGS[name as "zero"]) !== 0}
                                onClick={() => assign(name, flags & PROGRAM_FLAGS[name as "zero"] ? 0 : 1)}
                            >
                                {text}
                            </button>
                        ))}
                    </div>
                    <h4>
                        Stack{" "}
                        <span class="muted">
                            {depth} of {tables.value.stack_depth}
                        </span>
                    </h4>
                    {frames.value.length ? (
                        <ol class="stack">
                            {frames.value.map((frame, n) => (
                                <li key={n}>
                                    <button class="link" onClick={() => frame.line && openFile(frame.path, frame.line)}>
                                        {frame.name}
                                    </button>{" "}
                                    <span class="muted">
                                        {frame.address}
                                        {frame.path && `, ${frame.path}:${frame.line}`}
                                    </span>
                                </li>
                            ))}
                        </ol>
                    ) : (
                        <p class="muted note">No open CSUB.</p>
                    )}
                </>
            )}
            <Breakpoints />
            <h4>
                User variables{" "}
                <button class="link" onClick={() => (many.value = !many.value)}>
                    {many.value ? "fewer" : "all"}
                </button>
            </h4>
            <div class="variables">
                {variables.map(row => {
                    const value = parameters.value.globals.get(`2/${row.number}`);
                    return (
                        <div key={row.number} class="variable">
                            <label class={touched.value.has(keyOf(2, row.number)) ? "touched" : ""}>
                                <span>{row.number}</span>
                                <NumberField
                                    value={value ?? ""}
                                    hindrance={unread(value)}
                                    low={row.low}
                                    high={row.high}
                                    label={`User variable ${row.number}`}
                                    onCommit={next => send("SGP", row.number, 2, next).then(refresh)}
                                />
                            </label>
                            <WhoWrote value={`gp[${row.number}]`} />
                        </div>
                    );
                })}
            </div>
        </div>
    );
}

/** What the debugger can hold at besides breakpoints. */
function Breaks() {
    return (
        <fieldset class="breaks">
            <legend class="muted">Hold at</legend>
            {breaks.value.map(({ filter, label, description }) => (
                <label key={filter} class="check" title={description}>
                    <input
                        type="checkbox"
                        checked={chosenBreaks.value.includes(filter)}
                        onChange={event => void chooseBreak(filter, event.currentTarget.checked)}
                    />{" "}
                    {label}
                </label>
            ))}
        </fieldset>
    );
}

function Breakpoints() {
    return (
        <>
            <h4>Breakpoints</h4>
            {can.value.debug && <Breaks />}
            {can.value.debug && <DataBreakpoints />}
            {breakpoints.value.length ? (
                <ul class="breakpoint-list">
                    {breakpoints.value.map(point => (
                        <BreakpointRow key={`${point.path}:${point.line}`} point={point} />
                    ))}
                </ul>
            ) : (
                <p class="muted note">
                    Click left of a line number, or press F8. Right click or hold a finger there for conditions.
                    {!can.value.debug &&
                        " With breakpoints the program of a real module runs in single steps, much slower."}
                </p>
            )}
        </>
    );
}

function BreakpointRow({ point }: { point: Breakpoint }) {
    const place = placeOf(point);
    const met = hitsOf(point);
    const texts = [point.condition, point.hits && `hits ${point.hits}`, point.log && `log ${point.log}`].filter(
        Boolean,
    );
    return (
        <li>
            <span class={`breakpoint ${place?.verified ? "" : "unverified"} ${point.log ? "logpoint" : ""}`} />
            <button class="link" onClick={() => openFile(point.path, point.line)}>
                {point.path}:{point.line}
            </button>
            <span class="muted">{texts.join(", ") || (can.value.debug && place?.message)}</span>
            {met !== undefined && (
                <span class="pill" title="How often it was reached with its condition true">
                    met {met}×
                </span>
            )}
            <IconButton
                icon="close"
                size={12}
                label={`Remove breakpoint at line ${point.line}`}
                onClick={() => setBreakpoints(breakpoints.value.filter(other => other !== point))}
            />
        </li>
    );
}

function Register({ name, title, value }: { name: string; title: string; value: number }) {
    return (
        <div>
            <dt>{title}</dt>
            <dd data-figure={name}>
                <NumberField
                    value={value}
                    low={-(2 ** 31)}
                    high={2 ** 31 - 1}
                    label={title}
                    onCommit={next => assign(name, next)}
                />
            </dd>
            <dd class="muted">
                ${(value >>> 0).toString(16)} <WhoWrote value={name} />
            </dd>
        </div>
    );
}

const expressions = remembered<string[]>("expressions", []);
const values = signal<(number | string)[]>([]);

/** An expression that names a value which something can write. */
const REFERENCE = /^(accumulator|x|(gp|ap|co|out)(\[[^[\]]+\])+)$/i;
/** Between two looks at the watches; on a serial line each takes its time. */
const LOOK_MS = 400;
const SLOW_LOOK_MS = 1500;

/** Expressions over registers, variables, parameters, labels and constants. */
function Watches() {
    useEffect(() => {
        const look = async () => {
            if (!online.value || !expressions.value.length || document.hidden) return;
            values.value = await Promise.all(expressions.value.map(evaluate));
        };
        void look();
        const timer = setInterval(() => void look(), can.value.debug ? LOOK_MS : SLOW_LOOK_MS);
        return () => clearInterval(timer);
    }, [expressions.value]);
    const change = (at: number, text: string) => {
        const list = expressions.value.slice();
        if (text.trim()) list[at] = text.trim();
        else list.splice(at, 1);
        expressions.value = list;
    };
    return (
        <div class="watches">
            {expressions.value.map((expression, at) => {
                const value = values.value[at];
                return (
                    <div key={expression}>
                        <input
                            aria-label={`Watch ${at}`}
                            defaultValue={expression}
                            spellcheck={false}
                            onChange={event => change(at, event.currentTarget.value)}
                        />
                        {typeof value === "number" ? (
                            <NumberField
                                value={value}
                                label={`Value of ${expression}`}
                                onCommit={next => assign(expression, next)}
                            />
                        ) : (
                            <span class="bad" title={value}>
                                {value === undefined ? "…" : "no value"}
                            </span>
                        )}
                        {REFERENCE.test(expression) && <WhoWrote value={expression} />}
                        <IconButton
                            icon="close"
                            size={12}
                            label={`Remove watch ${expression}`}
                            onClick={() => change(at, "")}
                        />
                    </div>
                );
            })}
            <input
                aria-label="New watch"
                placeholder="ap[actual_position][0], gp[3], accumulator * 2"
                spellcheck={false}
                onChange={event => {
                    change(expressions.value.length, event.currentTarget.value);
                    event.currentTarget.value = "";
                }}
            />
        </div>
    );
}

export { Empty };
