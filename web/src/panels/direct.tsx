// Direct mode: one command at a time, by name or number, with the telegrams as they go over the line.
import { signal, useSignal } from "@preact/signals";
import { ask, link, notify, onServerEvent, tables } from "../logic/app";
import { remembered } from "../logic/settings";
import { currentView } from "../editor/following";
import type { CommandShape, Exchange, OperandShape, Parameter } from "../wire";
import { readNumber } from "../logic/text";
import { Empty, IconButton } from "../widgets/basics";
import { offline, unless } from "../logic/hindrance";

const chosen = remembered("direct-command", 6);
const fields = remembered<Record<string, string>>("direct-fields", { type: "0", motor: "0", value: "0" });
const line = remembered("direct-line", "");
const history = remembered<string[]>("direct-history", []);
/** A command of programs begins with its mnemonic; control functions have none. */
const MNEMONIC = /^[A-Z]/;
const answers = signal<{ exchange: Exchange; at: number }[]>([]);
let counter = 0;
/** The second reply of command 138 comes by itself: it is listed with the others. */
onServerEvent(event => {
    if (event.event !== "happened" || event.kind !== "target") return;
    const exchange: Exchange = {
        text: "138, second reply",
        sent: "",
        received: "",
        status: 100,
        value: 0,
        meaning: event.text,
    };
    answers.value = [...answers.value.slice(-199), { exchange, at: ++counter }];
});

async function perform(run: () => Promise<Exchange | null>): Promise<void> {
    const exchange = await run();
    if (!exchange) return;
    answers.value = [...answers.value.slice(-199), { exchange, at: ++counter }];
    if (recording.value && exchange.status === 100 && MNEMONIC.test(exchange.text)) insertIntoEditor(exchange.text);
    if (exchange.text !== history.value[history.value.length - 1]) recall(exchange.text);
}

/** Have a line come back with the arrow key. */
function recall(text: string): void {
    history.value = [...history.value.filter(other => other !== text).slice(-99), text];
}

/** The line is in the history at once, answered or not. */
function executeLine(text: string): Promise<void> {
    recall(text);
    return perform(() => ask({ call: "execute_text", line: text }));
}

function parameterRows(operand: OperandShape, bank: number): Parameter[] {
    if (operand.kind === "axis_parameter") return tables.value.axis;
    if (operand.kind === "global_parameter") return tables.value.globals.filter(row => row.bank === bank);
    return [];
}

function OperandField({ operand, row }: { operand: OperandShape; row: CommandShape }) {
    const value = fields.value[operand.field] ?? "0";
    const set = (text: string) => (fields.value = { ...fields.value, [operand.field]: text });
    const rows = parameterRows(operand, Number(fields.value.motor) || 0);
    const known = rows.find(item => String(item.number) === value);
    const name = `${operand.name} of ${row.mnemonic || row.title}`;
    return (
        <label class={`operand field-${operand.field}`}>
            <span>
                {operand.name}
                {rows.length && known ? <i> {known.access}</i> : null}
            </span>
            {operand.words.length ? (
                <select aria-label={name} value={value} onChange={event => set(event.currentTarget.value)}>
                    {operand.words.map(word => (
                        <option key={word.value} value={String(word.value)}>
                            {word.value} {word.text}
                        </option>
                    ))}
                </select>
            ) : rows.length ? (
                <select aria-label={name} value={value} onChange={event => set(event.currentTarget.value)}>
                    {!known && <option value={value}>{value}</option>}
                    {rows.map(item => (
                        <option key={item.key} value={String(item.number)}>
                            {item.number} {item.name}
                        </option>
                    ))}
                </select>
            ) : (
                <input
                    class={`number ${readNumber(value) === null ? "wrong" : ""}`}
                    aria-label={name}
                    value={value}
                    title={`${operand.low} to ${operand.high}`}
                    onInput={event => set(event.currentTarget.value)}
                />
            )}
        </label>
    );
}

function Form() {
    const rows = [...tables.value.commands.filter(row => row.where.includes("direct")), ...tables.value.control];
    const row = rows.find(item => item.number === chosen.value) ?? rows[0]!;
    const numbers = () => {
        const read = (name: string) =>
            row.operands.some(item => item.field === name) ? readNumber(fields.value[name] ?? "0") : 0;
        return { type: read("type"), motor: read("motor"), value: read("value") };
    };
    const whole = Object.values(numbers()).every(value => value !== null && Number.isInteger(value));
    return (
        <form
            class="direct-form"
            onSubmit={event => {
                event.preventDefault();
                const { type, motor, value } = numbers();
                if (type === null || motor === null || value === null) return;
                void perform(() => ask({ call: "execute", number: row.number, type, motor, value }));
            }}
        >
            <label class="operand instruction">
                <span>instruction</span>
                <select
                    aria-label="Instruction"
                    value={String(row.number)}
                    onChange={event => (chosen.value = Number(event.currentTarget.value))}
                >
                    <optgroup label="Commands">
                        {rows
                            .filter(item => item.mnemonic)
                            .map(item => (
                                <option key={item.number} value={String(item.number)}>
                                    {item.number} {item.mnemonic} · {item.title}
                                </option>
                            ))}
                    </optgroup>
                    <optgroup label="Control functions">
                        {rows
                            .filter(item => !item.mnemonic)
                            .map(item => (
                                <option key={item.number} value={String(item.number)}>
                                    {item.number} · {item.title}
                                </option>
                            ))}
                    </optgroup>
                </select>
            </label>
            {row.operands.map(operand => (
                <OperandField key={operand.field} operand={operand} row={row} />
            ))}
            <button
                class="primary"
                type="submit"
                {...unless(offline.value || (!whole && "Operands are whole numbers"))}
            >
                Execute
            </button>
            <button
                type="button"
                class={recording.value ? "recording" : ""}
                aria-pressed={recording.value}
                title="Copy each executed command into the program on the screen"
                onClick={() => (recording.value = !recording.value)}
            >
                {recording.value ? "Recording" : "Record"}
            </button>
            <p class="muted hint">
                {row.meaning} <span class="section">{row.section}</span>
            </p>
        </form>
    );
}

function Line() {
    const place = useSignal(0);
    return (
        <form
            class="direct-line"
            onSubmit={event => {
                event.preventDefault();
                const text = line.value.trim();
                if (!text) return;
                place.value = 0;
                void executeLine(text);
                line.value = "";
            }}
        >
            <span class="prompt" aria-hidden="true">
                ›
            </span>
            <input
                aria-label="Command line"
                placeholder="GAP 1, 0 (↑: again)"
                value={line.value}
                spellcheck={false}
                onInput={event => (line.value = event.currentTarget.value)}
                onKeyDown={event => {
                    const step = { ArrowUp: 1, ArrowDown: -1 }[event.key];
                    if (!step) return;
                    event.preventDefault();
                    place.value = Math.max(0, Math.min(history.value.length, place.value + step));
                    line.value = place.value ? history.value[history.value.length - place.value]! : "";
                }}
            />
        </form>
    );
}

export function insertIntoEditor(text: string): void {
    const view = currentView.value;
    if (!view) {
        notify("information", "Open a program to copy into.");
        return;
    }
    const at = view.state.doc.lineAt(view.state.selection.main.head);
    view.dispatch({
        changes: { from: at.to, insert: `${at.length ? "\n" : ""}    ${text}` },
        selection: { anchor: at.to },
        scrollIntoView: true,
    });
}

async function copyBytes({ sent, received }: Exchange): Promise<void> {
    await navigator.clipboard.writeText(received ? `${sent}\n${received}` : sent);
    notify("information", "The bytes are in the clipboard: request, and reply below it.");
}

/** Commands that the module has executed go into the program on the screen. */
const recording = signal(false);

function Answer({ exchange }: { exchange: Exchange }) {
    const good = exchange.status === 100;
    const plain = good && exchange.meaning.startsWith("success");
    return (
        <div class={`answer ${good ? "" : "bad"}`} role="listitem">
            <span class="command">{exchange.text}</span>
            <span class="bytes">
                <span title="Sent">{exchange.sent}</span>{" "}
                <span title="Received">{exchange.received || (exchange.sent ? "no answer" : "")}</span>
            </span>
            <span class="value" title="Value of the reply">
                {exchange.status && exchange.sent ? exchange.value : ""}
            </span>
            <span class="result" title={exchange.meaning}>
                {plain ? "100" : `${exchange.status || ""} ${exchange.meaning}`}
            </span>
            <span class="acts">
                {exchange.sent && (
                    <IconButton icon="table" label="Copy the bytes" onClick={() => void copyBytes(exchange)} />
                )}
                <IconButton icon="continue" label="Send again" onClick={() => executeLine(exchange.text)} />
                <IconButton icon="copy" label="Copy to the editor" onClick={() => insertIntoEditor(exchange.text)} />
            </span>
        </div>
    );
}

const terminal = signal<{ line: string; back: string }[]>([]);

/** The ASCII interface after command 139, with its way back. */
function Terminal() {
    const text = useSignal("");
    const sendLine = async (line: string) => {
        const back = await ask({ call: "send_ascii", line });
        if (back !== null) terminal.value = [...terminal.value.slice(-199), { line, back }];
        return back !== null;
    };
    /** A line that was refused stays, to be mended. */
    const submit = async () => {
        const line = text.value;
        if ((await sendLine(line)) && text.peek() === line) text.value = "";
    };
    return (
        <div class="terminal" aria-label="ASCII interface" role="region">
            <div class="row">
                <b>ASCII interface</b>{" "}
                <span class="muted">
                    The module's letter is put before each line. While it is on, no binary command is executed.
                </span>
                <button class="primary" onClick={() => sendLine("BIN")}>
                    Back to binary (BIN)
                </button>
            </div>
            <form
                class="direct-line"
                onSubmit={event => {
                    event.preventDefault();
                    void submit();
                }}
            >
                <span class="prompt" aria-hidden="true">
                    {"\u203a"}
                </span>
                <input
                    aria-label="ASCII line"
                    placeholder="GAP 1, 0"
                    value={text.value}
                    spellcheck={false}
                    onInput={event => (text.value = event.currentTarget.value)}
                />
            </form>
            <div role="log" class="mono">
                {terminal.value
                    .slice()
                    .reverse()
                    .map(({ line, back }, at) => (
                        <div key={terminal.value.length - at}>
                            <b>{line}</b> {back || "nothing came back"}
                        </div>
                    ))}
            </div>
        </div>
    );
}

export function Direct() {
    const list = answers.value;
    if (link.value.ascii) return <Terminal />;
    return (
        <div class="direct">
            <div class="left">
                <Form />
                <Line />
            </div>
            <div class="answers">
                {list.length ? (
                    <div role="list" aria-label="Answers">
                        {list
                            .slice()
                            .reverse()
                            .map(({ exchange, at }) => (
                                <Answer key={at} exchange={exchange} />
                            ))}
                    </div>
                ) : (
                    <Empty icon="right" title="Nothing sent yet">
                        Try{" "}
                        <button class="link" onClick={() => executeLine("GAP 1, 0")}>
                            GAP 1, 0
                        </button>{" "}
                        to read the position of motor 0: that moves nothing.
                    </Empty>
                )}
            </div>
        </div>
    );
}
