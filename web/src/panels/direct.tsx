// Direct mode: one command at a time, by name or number, with the telegrams as they go over the line.
import { signal, useSignal } from "@preact/signals";
import { ask, notify, online, tables } from "../logic/app";
import { remembered } from "../logic/settings";
import { currentView } from "../editor/editor";
import type { CommandShape, Exchange, OperandShape, Parameter } from "../wire";
import { readNumber } from "../logic/text";
import { Empty } from "../widgets/basics";
import { Icon } from "../widgets/icons";

const chosen = remembered("direct-command", 6);
const fields = remembered<Record<string, string>>("direct-fields", { type: "0", motor: "0", value: "0" });
const line = remembered("direct-line", "");
const history = remembered<string[]>("direct-history", []);
const answers = signal<{ exchange: Exchange; at: number }[]>([]);
let counter = 0;

async function perform(run: () => Promise<Exchange | null>): Promise<void> {
    const exchange = await run();
    if (!exchange) return;
    answers.value = [...answers.value.slice(-199), { exchange, at: ++counter }];
    if (exchange.text !== history.value[history.value.length - 1]) recall(exchange.text);
}

/** Have a line come back with the arrow key. */
function recall(text: string): void {
    history.value = [...history.value.filter((other) => other !== text).slice(-99), text];
}

/** The line is in the history at once, answered or not. */
function executeLine(text: string): Promise<void> {
    recall(text);
    return perform(() => ask({ call: "execute_text", line: text }));
}

function parameterRows(operand: OperandShape, bank: number): Parameter[] {
    if (operand.kind === "axis_parameter") return tables.value.axis;
    if (operand.kind === "global_parameter") return tables.value.globals.filter((row) => row.bank === bank);
    return [];
}

function OperandField({ operand, row }: { operand: OperandShape; row: CommandShape }) {
    const value = fields.value[operand.field] ?? "0";
    const set = (text: string) => (fields.value = { ...fields.value, [operand.field]: text });
    const rows = parameterRows(operand, Number(fields.value.motor) || 0);
    const known = rows.find((item) => String(item.number) === value);
    const name = `${operand.name} of ${row.mnemonic || row.title}`;
    return (
        <label class={`operand field-${operand.field}`}>
            <span>{operand.name}{rows.length && known ? <i> {known.access}</i> : null}</span>
            {operand.words.length ? (
                <select aria-label={name} value={value} onChange={(event) => set(event.currentTarget.value)}>
                    {operand.words.map((word) => <option key={word.value} value={String(word.value)}>{word.value} {word.text}</option>)}
                </select>
            ) : rows.length ? (
                <select aria-label={name} value={value} onChange={(event) => set(event.currentTarget.value)}>
                    {!known && <option value={value}>{value}</option>}
                    {rows.map((item) => <option key={item.key} value={String(item.number)}>{item.number} {item.name}</option>)}
                </select>
            ) : (
                <input class={`number ${readNumber(value) === null ? "wrong" : ""}`} aria-label={name} value={value}
                    title={`${operand.low} to ${operand.high}`} onInput={(event) => set(event.currentTarget.value)} />
            )}
        </label>
    );
}

function Form() {
    const rows = [...tables.value.commands.filter((row) => row.where.includes("direct")), ...tables.value.control];
    const row = rows.find((item) => item.number === chosen.value) ?? rows[0]!;
    const numbers = () => {
        const read = (name: string) => (row.operands.some((item) => item.field === name) ? readNumber(fields.value[name] ?? "0") : 0);
        return { type: read("type"), motor: read("motor"), value: read("value") };
    };
    const whole = Object.values(numbers()).every((value) => value !== null && Number.isInteger(value));
    return (
        <form class="direct-form" onSubmit={(event) => {
            event.preventDefault();
            const { type, motor, value } = numbers();
            if (type === null || motor === null || value === null) return;
            void perform(() => ask({ call: "execute", number: row.number, type, motor, value }));
        }}>
            <label class="operand instruction"><span>instruction</span>
                <select aria-label="Instruction" value={String(row.number)}
                    onChange={(event) => (chosen.value = Number(event.currentTarget.value))}>
                    <optgroup label="Commands">{rows.filter((item) => item.mnemonic).map((item) =>
                        <option key={item.number} value={String(item.number)}>{item.number} {item.mnemonic} · {item.title}</option>)}</optgroup>
                    <optgroup label="Control functions">{rows.filter((item) => !item.mnemonic).map((item) =>
                        <option key={item.number} value={String(item.number)}>{item.number} · {item.title}</option>)}</optgroup>
                </select>
            </label>
            {row.operands.map((operand) => <OperandField key={operand.field} operand={operand} row={row} />)}
            <button class="primary" type="submit" disabled={!online.value || !whole}>Execute</button>
            <p class="muted hint">{row.meaning} <span class="section">{row.section}</span></p>
        </form>
    );
}

function Line() {
    const place = useSignal(0);
    return (
        <form class="direct-line" onSubmit={(event) => {
            event.preventDefault();
            const text = line.value.trim();
            if (!text) return;
            place.value = 0;
            void executeLine(text);
            line.value = "";
        }}>
            <span class="prompt" aria-hidden="true">›</span>
            <input aria-label="Command line" placeholder="GAP 1, 0 — Enter sends, ↑ brings back" value={line.value} spellcheck={false}
                onInput={(event) => (line.value = event.currentTarget.value)}
                onKeyDown={(event) => {
                    const step = { ArrowUp: 1, ArrowDown: -1 }[event.key];
                    if (!step) return;
                    event.preventDefault();
                    place.value = Math.max(0, Math.min(history.value.length, place.value + step));
                    line.value = place.value ? history.value[history.value.length - place.value]! : "";
                }} />
        </form>
    );
}

export function insertIntoEditor(text: string): void {
    const view = currentView.value;
    if (!view) return notify("information", "Open a program to copy into.");
    const at = view.state.doc.lineAt(view.state.selection.main.head);
    view.dispatch({ changes: { from: at.to, insert: `${at.length ? "\n" : ""}    ${text}` }, selection: { anchor: at.to }, scrollIntoView: true });
}

function Answer({ exchange }: { exchange: Exchange }) {
    const good = exchange.status === 100;
    const plain = good && exchange.meaning.startsWith("success");
    return (
        <div class={`answer ${good ? "" : "bad"}`} role="listitem">
            <span class="command">{exchange.text}</span>
            <span class="bytes"><span title="Sent">{exchange.sent}</span> <span title="Received">{exchange.received || "no answer"}</span></span>
            <span class="value" title="Value of the answer">{exchange.status ? exchange.value : ""}</span>
            <span class="result" title={exchange.meaning}>{plain ? "100" : `${exchange.status || ""} ${exchange.meaning}`}</span>
            <span class="acts">
                <button class="tool" title="Send again" aria-label="Send again" onClick={() => executeLine(exchange.text)}><Icon name="continue" /></button>
                <button class="tool" title="Copy to the editor" aria-label="Copy to the editor" onClick={() => insertIntoEditor(exchange.text)}><Icon name="copy" /></button>
            </span>
        </div>
    );
}

export function Direct() {
    const list = answers.value;
    return (
        <div class="direct">
            <div class="left"><Form /><Line /></div>
            <div class="answers">
                {list.length ? (
                    <div role="list" aria-label="Answers">{list.slice().reverse().map(({ exchange, at }) => <Answer key={at} exchange={exchange} />)}</div>
                ) : <Empty icon="right" title="Nothing sent yet">Try <button class="link" onClick={() => executeLine("GAP 1, 0")}>GAP 1, 0</button> to
                    read the position of motor 0: that moves nothing.</Empty>}
            </div>
        </div>
    );
}
