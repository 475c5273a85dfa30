// All parameters of the module: seen, explained, changed, stored, exported.
import { signal, useSignal } from "@preact/signals";
import { useEffect } from "preact/hooks";
import { ask, can, online, powered, send, tables } from "../logic/app";
import { COORDINATE_BANK, keyOf, parameters, refresh, touched } from "../logic/parameters";
import { remembered } from "../logic/settings";
import type { Eeprom, Parameter, StoredValue, Watched } from "../wire";
import { notReady, ready } from "../logic/authority";
import { Choice, Empty, Menu } from "../widgets/basics";
import { NumberField, SelectField } from "../widgets/fields";
import { Icon } from "../widgets/icons";
import { SECTIONS, section, type SectionName } from "../logic/views";
import { exportSettings, pickSettings } from "../logic/exchange";
import { want } from "./program";

const filter = signal("");
const changedOnly = remembered("parameter-changed", false);

const axisValue = (row: Parameter, motor: number) => parameters.value.axis.get(row.number)?.[motor];
const globalValue = (row: Parameter) => parameters.value.globals.get(`${row.bank}/${row.number}`);

function found(row: Parameter): boolean {
    const words = filter.value.toLowerCase().split(/\s+/).filter(Boolean);
    const text = `${row.number} ${row.name} ${row.key} ${row.meaning} ${row.unit}`.toLowerCase();
    return words.every(word => text.includes(word));
}

/** The registers of the motion chip and its driver chain: their defaults are the chip's affair, and the manual warns of them. */
const LAST_CHIP_PARAMETER = 38;
const ofChip = (row: Parameter): boolean => row.bank === 0 && row.number <= LAST_CHIP_PARAMETER;
/** A stored value that is not the default any more. */
const changed = (row: Parameter, value: number | null | undefined): boolean =>
    value != null && row.access.includes("W") && row.access.includes("E") && value !== row.default;
const GROUPS: readonly (readonly [number, string])[] = [
    [0, "Motion chip and driver chain: wrong values damage the motor drivers (8.1)"],
    [64, "Stored in the EEPROM"],
    [128, "State"],
];

function Cell({ row, motor, value }: { row: Parameter; motor: number; value: number | null | undefined }) {
    if (value === undefined) return <td class="cell muted">…</td>;
    if (value === null)
        return (
            <td class="cell muted" title="This module does not have it">
                –
            </td>
        );
    const set = (next: number) =>
        void send(row.bank === -1 ? "SAP" : "SGP", row.number, row.bank === -1 ? motor : row.bank, next).then(refresh);
    const label = row.bank === -1 ? `${row.name} of motor ${motor}` : row.name;
    const writable = row.access.includes("W");
    const differs = changed(row, value);
    const glow = touched.value.has(keyOf(row.bank, row.number, row.bank === -1 ? motor : 0));
    return (
        <td
            class={`cell ${differs ? "differs" : ""} ${glow ? "touched" : ""}`}
            title={differs ? `Default ${row.default}` : undefined}
        >
            {!writable ? (
                <span class="value">{row.choices.find(choice => choice.value === value)?.text ?? value}</span>
            ) : row.choices.length ? (
                <SelectField
                    label={label}
                    value={value}
                    choices={row.choices}
                    disabled={!online.value}
                    onCommit={set}
                />
            ) : (
                <NumberField
                    value={value}
                    low={row.low}
                    high={row.high}
                    label={label}
                    disabled={!online.value}
                    onCommit={set}
                />
            )}
        </td>
    );
}

function Range({ row }: { row: Parameter }) {
    const text =
        row.low === -(2 ** 31)
            ? "±2³¹"
            : row.low === -(2 ** 23)
              ? "±2²³"
              : row.high === 2 ** 23 - 1
                ? "0…2²³"
                : `${row.low}…${row.high}`.replace("-", "\u2212");
    return (
        <td class="range">
            {row.access.includes("W") ? (
                <>
                    <b>{text}</b> {ofChip(row) ? null : <span title="Default">({row.default})</span>}
                </>
            ) : (
                "read only"
            )}
            {row.unit && <div>{row.unit}</div>}
        </td>
    );
}

function What({ row }: { row: Parameter }) {
    return (
        <td class="what">
            <b>{row.name}</b>
            <p title={row.meaning}>
                {row.meaning} <span class="section">{row.section}</span>
            </p>
        </td>
    );
}

type Keeping = "store" | "restore";
const keep = (action: Keeping, items: Watched[]) => ask({ call: "keep", action, items });

/** All stored axis parameters that the module has. */
const allStored = (): Watched[] =>
    tables.value.axis
        .filter(row => row.access.includes("E"))
        .flatMap(row =>
            [0, 1, 2]
                .filter(motor => axisValue(row, motor) != null)
                .map(motor => ({ bank: -1, number: row.number, motor })),
        );

/** Store or restore a parameter of one motor or of all. */
function KeepRow({ row }: { row: Parameter }) {
    const entry = (action: Keeping, motors: number[]) => {
        const title = `${action === "store" ? "Store" : "Restore"} ${motors.length === 1 ? `motor ${motors[0]}` : "all three motors"}`;
        return (
            <button
                key={title}
                role="menuitem"
                title={
                    action === "store"
                        ? "The value of now goes to the EEPROM (STAP)"
                        : "The stored value comes back (RSAP)"
                }
                disabled={!online.value}
                onClick={() =>
                    keep(
                        action,
                        motors.map(motor => ({ bank: -1, number: row.number, motor })),
                    )
                }
            >
                <Icon name={action === "store" ? "save" : "undo"} size={13} /> {title}
            </button>
        );
    };
    const all = (action: Keeping) => [[0], [1], [2], [0, 1, 2]].map(motors => entry(action, motors));
    return (
        <Menu icon="save" label={`Store or restore ${row.name}`}>
            {all("store")}
            {all("restore")}
        </Menu>
    );
}

function AxisTable() {
    want("axis");
    const rows = tables.value.axis.filter(
        row => found(row) && (!changedOnly.value || [0, 1, 2].some(motor => changed(row, axisValue(row, motor)))),
    );
    return (
        <table class="parameters three">
            <thead>
                <tr>
                    <th>no.</th>
                    <th>parameter</th>
                    {[0, 1, 2].map(motor => (
                        <th key={motor} class={`motor motor${motor}`}>
                            motor {motor}
                        </th>
                    ))}
                    <th>range (default)</th>
                    <th />
                </tr>
            </thead>
            <tbody>
                {rows.map(row => (
                    <tr key={row.number}>
                        <td class="no">{row.number}</td>
                        <What row={row} />
                        {[0, 1, 2].map(motor => (
                            <Cell key={motor} row={row} motor={motor} value={axisValue(row, motor)} />
                        ))}
                        <Range row={row} />
                        <td class="acts">{row.access.includes("E") && <KeepRow row={row} />}</td>
                    </tr>
                ))}
            </tbody>
        </table>
    );
}

function GlobalTable() {
    want("globals");
    const rows = tables.value.globals.filter(
        row => row.bank === 0 && found(row) && (!changedOnly.value || changed(row, globalValue(row))),
    );
    return (
        <table class="parameters">
            <thead>
                <tr>
                    <th>no.</th>
                    <th>parameter</th>
                    <th>value</th>
                    <th>range (default)</th>
                </tr>
            </thead>
            {GROUPS.map(([first, title], at) => {
                const members = rows.filter(
                    row => row.number >= first && row.number < (GROUPS[at + 1]?.[0] ?? Infinity),
                );
                return (
                    members.length > 0 && (
                        <tbody key={title}>
                            <tr class="group">
                                <th colSpan={4} scope="rowgroup" class={first === 0 ? "warn" : ""}>
                                    {title}
                                </th>
                            </tr>
                            {members.map(row => (
                                <tr key={row.number}>
                                    <td class="no">{row.number}</td>
                                    <What row={row} />
                                    <Cell row={row} motor={0} value={globalValue(row)} />
                                    <Range row={row} />
                                </tr>
                            ))}
                        </tbody>
                    )
                );
            })}
        </table>
    );
}

function Variables() {
    want("variables");
    const rows = tables.value.globals.filter(row => row.bank === 2);
    return (
        <div class="variables wide">
            {rows.map(row => (
                <div key={row.number} class={touched.value.has(keyOf(2, row.number)) ? "touched" : ""}>
                    <span>{row.number}</span>
                    <NumberField
                        value={globalValue(row) ?? ""}
                        disabled={!online.value || globalValue(row) == null}
                        low={row.low}
                        high={row.high}
                        label={`User variable ${row.number}`}
                        onCommit={value => void send("SGP", row.number, 2, value).then(refresh)}
                    />
                    <button
                        class="tool"
                        title="Store (STGP)"
                        aria-label={`Store variable ${row.number}`}
                        onClick={() => send("STGP", row.number, 2)}
                    >
                        <Icon name="save" size={13} />
                    </button>
                    <button
                        class="tool"
                        title="Bring back what is stored (RSGP)"
                        aria-label={`Restore variable ${row.number}`}
                        onClick={() => void send("RSGP", row.number, 2).then(refresh)}
                    >
                        <Icon name="undo" size={13} />
                    </button>
                </div>
            ))}
        </div>
    );
}

function Coordinates() {
    want("coordinates");
    const rows = Array.from({ length: tables.value.coordinates }, (_, n) => n);
    return (
        <table class="parameters coordinates">
            <thead>
                <tr>
                    <th>no.</th>
                    {[0, 1, 2].map(motor => (
                        <th key={motor} class={`motor motor${motor}`}>
                            motor {motor}
                        </th>
                    ))}
                    <th />
                </tr>
            </thead>
            <tbody>
                {rows.map(number => (
                    <tr key={number}>
                        <td class="no">{number}</td>
                        {[0, 1, 2].map(motor => {
                            const value = parameters.value.coordinates[number]?.[motor];
                            return (
                                <td
                                    key={motor}
                                    class={`cell ${touched.value.has(keyOf(COORDINATE_BANK, number, motor)) ? "touched" : ""}`}
                                >
                                    {value == null ? (
                                        <span class="muted">…</span>
                                    ) : (
                                        <NumberField
                                            value={value}
                                            low={-(2 ** 23)}
                                            high={2 ** 23 - 1}
                                            label={`Coordinate ${number} of motor ${motor}`}
                                            onCommit={next => void send("SCO", number, motor, next).then(refresh)}
                                        />
                                    )}
                                </td>
                            );
                        })}
                        <td class="acts wide">
                            <button
                                onClick={() => void send("CCO", number, 7).then(refresh)}
                                title="Take the actual positions of all motors (CCO)"
                            >
                                capture
                            </button>
                            <button
                                disabled={!ready.value}
                                onClick={() => ask({ call: "go", coordinate: number, motors: [0, 1, 2] })}
                                title={notReady.value || "Move all motors there (MVP COORD)"}
                            >
                                go
                            </button>
                        </td>
                    </tr>
                ))}
            </tbody>
        </table>
    );
}

function EepromView() {
    const eeprom = useSignal<Eeprom | null>(null);
    const load = () => void ask({ call: "read_eeprom" }).then(found => (eeprom.value = found));
    useEffect(() => {
        if (can.value.bench) load();
    }, []);
    if (!can.value.bench)
        return (
            <Empty icon="table" title="Not readable over the wire">
                A real module shows its EEPROM only by RSAP and RSGP, value by value.
            </Empty>
        );
    const found = eeprom.value;
    if (!found) return <Empty icon="table" title="Reading…" />;
    const bytes = found.image.match(/../g) ?? [];
    const rows: string[] = [];
    for (let at = 0; at < Math.min(bytes.length, 4096); at += 16) {
        const part = bytes.slice(at, at + 16);
        const text = part
            .map(byte => {
                const code = parseInt(byte, 16);
                return code >= 32 && code < 127 ? String.fromCharCode(code) : "·";
            })
            .join("");
        rows.push(`${at.toString(16).padStart(5, "0")}  ${part.join(" ").padEnd(47)}  ${text}`);
    }
    const of = ({ bank, motor }: StoredValue) =>
        bank === -1 || bank === COORDINATE_BANK ? `motor ${motor}` : `bank ${bank}`;
    const name = (bank: number, number: number) =>
        bank === COORDINATE_BANK
            ? `coordinate ${number}`
            : ((bank === -1 ? tables.value.axis : tables.value.globals.filter(row => row.bank === bank)).find(
                  row => row.number === number,
              )?.name ?? "");
    return (
        <div class="eeprom">
            <p class="muted note">
                {found.file ? (
                    <>
                        Kept in <code>{found.file}</code>.
                    </>
                ) : (
                    "Kept in memory only: it is gone when the IDE ends."
                )}{" "}
                {bytes.length} bytes. <button onClick={load}>Read again</button>
            </p>
            <div class="columns">
                <table class="stored">
                    <thead>
                        <tr>
                            <th>no.</th>
                            <th>stored parameter</th>
                            <th>of</th>
                            <th>value</th>
                        </tr>
                    </thead>
                    <tbody>
                        {found.values.map(value => (
                            <tr key={`${value.bank}/${value.number}/${value.motor}`}>
                                <td class="no">{value.number}</td>
                                <td>{name(value.bank, value.number)}</td>
                                <td class="muted">{of(value)}</td>
                                <td class="value">{value.value}</td>
                            </tr>
                        ))}
                    </tbody>
                </table>
                <pre class="hex">
                    {rows.join("\n")}
                    {bytes.length > 4096 ? "\n…" : ""}
                </pre>
            </div>
        </div>
    );
}

export function Parameters() {
    const views = {
        axis: AxisTable,
        globals: GlobalTable,
        variables: Variables,
        coordinates: Coordinates,
        eeprom: EepromView,
    };
    const View = views[section.value];
    return (
        <div class="page parameters-page">
            <div class="bar">
                <Choice
                    label="Parameters"
                    value={section.value}
                    onChange={value => (section.value = value)}
                    options={Object.entries(SECTIONS) as [SectionName, string][]}
                />
                {(section.value === "axis" || section.value === "globals") && (
                    <>
                        <label class="search">
                            <Icon name="search" />
                            <input
                                placeholder="number, name or meaning"
                                aria-label="Search parameters"
                                value={filter.value}
                                onInput={event => (filter.value = event.currentTarget.value)}
                            />
                        </label>
                        <label class="check">
                            <input
                                type="checkbox"
                                checked={changedOnly.value}
                                onChange={event => (changedOnly.value = event.currentTarget.checked)}
                            />{" "}
                            changed only
                        </label>
                    </>
                )}
                <span class="gap" />
                {section.value === "axis" && (
                    <button
                        onClick={() => keep("store", allStored())}
                        disabled={!online.value}
                        title="Store all axis parameters as they are now (STAP)"
                    >
                        <Icon name="save" /> Store all
                    </button>
                )}
                {section.value === "axis" && (
                    <button
                        onClick={() => keep("restore", allStored())}
                        disabled={!online.value}
                        title="Bring back all axis parameters as they are stored (RSAP)"
                    >
                        <Icon name="undo" /> Restore all
                    </button>
                )}
                <button
                    onClick={() => exportSettings("tmcl")}
                    disabled={!online.value}
                    title="All settings as TMCL source"
                >
                    Export .tmc
                </button>
                <button onClick={() => exportSettings("toml")} disabled={!online.value} title="All settings as TOML">
                    Export .toml
                </button>
                <button onClick={pickSettings} disabled={!online.value}>
                    Import…
                </button>
            </div>
            <div class={`scroll ${powered.value ? "" : "dimmed"}`} tabIndex={0} aria-label="Values">
                <View />
            </div>
        </div>
    );
}
