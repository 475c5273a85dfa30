// The cells of the tables of parameters.
import { ask, send, tables } from "../../logic/app";
import { axisValue, keyOf, onDemand, readNow, refresh, touched } from "../../logic/parameters";
import { physicalOf, unitsOf } from "../../logic/scales";
import { rangeText } from "../../logic/units";
import { Menu } from "../../widgets/basics";
import { NumberField, SelectField } from "../../widgets/fields";
import { Icon } from "../../widgets/icons";
import type { Parameter, Watched } from "../../wire";
import { offline, unless } from "../../logic/hindrance";

/** The registers of the motion chip and its driver chain: their defaults are the chip's affair, and the manual warns of them. */
export const ofChip = (row: Parameter): boolean => row.bank === 0 && row.group === tables.value.global_groups[0];
/** A stored value that is not the default any more. */
export const changed = (row: Parameter, value: number | null | undefined): boolean =>
    value != null && row.access.includes("W") && row.access.includes("E") && value !== row.default;

export function Cell({ row, motor, value }: { row: Parameter; motor: number; value: number | null | undefined }) {
    if (onDemand(row)) return <Asked row={row} value={value} />;
    if (value === undefined) return <td class="cell muted">…</td>;
    if (value === null)
        return (
            <td class="cell muted" title="The module has no such value, or has not replied yet">
                –
            </td>
        );
    const set = (next: number) =>
        send(row.bank === -1 ? "SAP" : "SGP", row.number, row.bank === -1 ? motor : row.bank, next).then(refresh);
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
                    hindrance={offline.value}
                    onCommit={set}
                />
            ) : (
                <NumberField
                    units={row.bank === -1 ? unitsOf(row, motor) : undefined}
                    value={value}
                    low={row.low}
                    high={row.high}
                    label={label}
                    hindrance={offline.value}
                    onCommit={set}
                />
            )}
            {row.bank === -1 && <Physical row={row} motor={motor} value={value} />}
        </td>
    );
}

/** A value that is read at a click, because reading it does something in the module. */
function Asked({ row, value }: { row: Parameter; value: number | null | undefined }) {
    return (
        <td class="cell">
            {value != null && <span class="value">{value}</span>}{" "}
            <button
                {...unless(offline.value, "Reading it does something in the module, so it is read only when asked for")}
                aria-label={`Read ${row.name}`}
                onClick={() => readNow([{ bank: row.bank, number: row.number, motor: 0 }])}
            >
                {value == null ? "read" : "again"}
            </button>
        </td>
    );
}

/** What a value is in physical units, below it. */
function Physical({ row, motor, value }: { row: Parameter; motor: number; value: number }) {
    const text = physicalOf(row, motor, value);
    return text ? <div class="physical">{text}</div> : null;
}

export function Range({ row }: { row: Parameter }) {
    return (
        <td class="range">
            {row.access.includes("W") ? (
                <>
                    <b>{rangeText(row.low, row.high)}</b>{" "}
                    {ofChip(row) ? null : <span title="Default">({row.default})</span>}
                </>
            ) : (
                "read only"
            )}
            {row.unit && <div>{row.unit}</div>}
        </td>
    );
}

export function What({ row }: { row: Parameter }) {
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
export const keep = (action: Keeping, items: Watched[]) => ask({ call: "keep", action, items });

/** All stored axis parameters that the module has. */
export const allStored = (): Watched[] =>
    tables.value.axis
        .filter(row => row.access.includes("E"))
        .flatMap(row =>
            [0, 1, 2]
                .filter(motor => axisValue(row, motor) != null)
                .map(motor => ({ bank: -1, number: row.number, motor })),
        );

/** Store or restore a parameter of one motor or of all. */
export function KeepRow({ row }: { row: Parameter }) {
    const entry = (action: Keeping, motors: number[]) => {
        const title = `${action === "store" ? "Store" : "Restore"} ${motors.length === 1 ? `motor ${motors[0]}` : "all three motors"}`;
        return (
            <button
                key={title}
                role="menuitem"
                {...unless(
                    offline.value,
                    action === "store"
                        ? "The value of now goes to the EEPROM (STAP)"
                        : "The stored value comes back (RSAP)",
                )}
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
