// The registers of the motion chips: of a virtual module all, as they are now; of a real one what bank 0 reads.
import { useSignal } from "@preact/signals";
import { useEffect } from "preact/hooks";
import { can, connection, online, send, tables } from "../../logic/app";
import { remembered } from "../../logic/settings";
import { matches } from "../../logic/text";
import type { RegisterShape } from "../../wire";
import { Choice } from "../../widgets/basics";
import { NumberField } from "../../widgets/fields";
import { Icon } from "../../widgets/icons";
import { offline, unless } from "../../logic/hindrance";

const shownMotor = remembered("register-motor", 0);
const filter = remembered("register-filter", "");
const LOOK_MS = 500;
/** Parameters of bank 0 that are registers; the tables behind them have pages of their own. */
const LAST_REGISTER = 6;

const hex = (value: number): string => value.toString(16).toUpperCase().padStart(6, "0");

export function Registers() {
    return (
        <div class="tool-body registers-tool">
            {can.value.bench && <Chips />}
            <BankZero />
        </div>
    );
}

function Chips() {
    const rows = useSignal<RegisterShape[]>([]);
    useEffect(() => {
        const look = async () => {
            if (document.hidden || !online.value) return;
            rows.value = (await connection.call({ call: "read_registers" }).catch(() => null)) ?? rows.value;
        };
        void look();
        const timer = setInterval(() => void look(), LOOK_MS);
        return () => clearInterval(timer);
    }, []);
    const words = filter.value.toLowerCase().split(/\s+/).filter(Boolean);
    const shown = rows.value
        .filter(row => row.motor === shownMotor.value)
        .filter(row => matches([row.name, ...row.fields.map(field => field.name)].join(" "), words));
    return (
        <section>
            <div class="row">
                <Choice
                    label="Registers of"
                    value={shownMotor.value}
                    options={
                        [
                            [0, "Motor 0"],
                            [1, "Motor 1"],
                            [2, "Motor 2"],
                            [-1, "Common"],
                        ] as const
                    }
                    onChange={value => (shownMotor.value = value)}
                />
                <label class="search">
                    <Icon name="filter" />
                    <input
                        placeholder="filter: names of registers or fields"
                        aria-label="Filter registers"
                        value={filter.value}
                        onInput={event => (filter.value = event.currentTarget.value)}
                    />
                </label>
                <span class="muted note">Read without bus traffic: reading has no effect.</span>
            </div>
            <div class="scroll-x" tabIndex={0} role="region" aria-label="Registers">
                <table class="register-table">
                    <thead>
                        <tr>
                            <th scope="col">register</th>
                            <th scope="col">index</th>
                            <th scope="col">24 bits</th>
                            <th scope="col">fields</th>
                            <th scope="col" title="Section of the datasheet">
                                sheet
                            </th>
                        </tr>
                    </thead>
                    <tbody>
                        {shown.map(row => (
                            <tr key={`${row.chip} ${row.name}`}>
                                <th scope="row">
                                    {row.name}
                                    {row.motor < 0 && row.chip > 0 ? ` (chip ${row.chip + 1})` : ""}
                                </th>
                                <td class="value">{row.index}</td>
                                <td class="value">${hex(row.value)}</td>
                                <td class="fields">
                                    {row.fields.map(field => (
                                        <span
                                            key={field.name}
                                            title={`bits ${field.high} to ${field.low}, ${field.access}`}
                                        >
                                            {field.name === row.name ? "" : `${field.name} `}
                                            <b>{field.value}</b>
                                        </span>
                                    ))}
                                </td>
                                <td class="muted">{row.section}</td>
                            </tr>
                        ))}
                    </tbody>
                </table>
            </div>
        </section>
    );
}

function BankZero() {
    const values = useSignal<ReadonlyMap<number, number | null>>(new Map());
    const rows = tables.value.globals.filter(row => row.bank === 0 && row.number <= LAST_REGISTER);
    const read = async () => {
        const items = rows.map(row => ({ bank: 0, number: row.number, motor: 0 }));
        const found = await connection.call({ call: "read_many", items }).catch(() => null);
        if (found) values.value = new Map(rows.map((row, at) => [row.number, found[at] ?? null]));
    };
    return (
        <section class="card">
            <h3>Parameters 0 to {LAST_REGISTER} of bank 0</h3>
            <p class="note">
                <span class="warn">The manual warns that wrong values damage the drivers.</span> What is written goes
                straight to the chip; each write asks first. Reading 0 and 1 has the chip exchange another datagram with
                the drivers.
            </p>
            <div class="row">
                <button {...unless(offline.value)} onClick={read}>
                    Read them
                </button>
            </div>
            <div class="grid bank-zero">
                {rows.map(row => {
                    const value = values.value.get(row.number);
                    const writable = row.access.includes("W");
                    return (
                        <label key={row.number} title={row.meaning}>
                            {row.name} ({row.number})
                            {value == null ? (
                                <span class="muted">{values.value.has(row.number) ? "refused" : "not read"}</span>
                            ) : writable ? (
                                <NumberField
                                    value={value}
                                    low={row.low}
                                    high={row.high}
                                    label={row.name}
                                    hindrance={offline.value}
                                    onCommit={next => send("SGP", row.number, 0, next).then(read)}
                                />
                            ) : (
                                <b class="value">${hex(value)}</b>
                            )}
                        </label>
                    );
                })}
            </div>
        </section>
    );
}
