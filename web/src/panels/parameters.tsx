// All parameters of the module: seen, explained, changed, stored, exported.
import { signal } from "@preact/signals";
import { powered, stale, tables } from "../logic/app";
import { exportSettings, pickSettings } from "../logic/exchange";
import { axisValue, globalValue, keyOf } from "../logic/parameters";
import { remembered } from "../logic/settings";
import { SECTIONS, section, type SectionName } from "../logic/views";
import { Choice } from "../widgets/basics";
import { Icon } from "../widgets/icons";
import type { Parameter } from "../wire";
import { EepromView } from "./parameters/eeprom";
import { Cell, KeepRow, Range, What, allStored, changed, keep } from "./parameters/rows";
import { Coordinates, Variables } from "./parameters/stored";
import { WhoWrote, WhoWroteOf } from "./past";
import { want } from "./program";
import { offline, unless } from "../logic/hindrance";

const filter = signal("");
const changedOnly = remembered("parameter-changed", false);

function found(row: Parameter): boolean {
    const words = filter.value.toLowerCase().split(/\s+/).filter(Boolean);
    const text = `${row.number} ${row.name} ${row.key} ${row.meaning} ${row.unit} ${row.group}`.toLowerCase();
    return words.every(word => text.includes(word));
}

/** Rows of a table below the titles of their groups. */
function Groups({
    titles,
    rows,
    columns,
    children,
}: {
    titles: readonly string[];
    rows: readonly Parameter[];
    columns: number;
    children: (row: Parameter) => preact.JSX.Element;
}) {
    return titles.map(title => {
        const members = rows.filter(row => row.group === title);
        const chips = title === tables.value.global_groups[0];
        return (
            members.length > 0 && (
                <tbody key={title}>
                    <tr class="group">
                        <th colSpan={columns} scope="rowgroup" class={chips ? "warn" : ""}>
                            {title}
                            {chips && ": wrong values damage the motor drivers (8.1)"}
                        </th>
                    </tr>
                    {members.map(children)}
                </tbody>
            )
        );
    });
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
            <Groups titles={tables.value.axis_groups} rows={rows} columns={7}>
                {row => (
                    <tr key={row.number} data-parameter={keyOf(row.bank, row.number)}>
                        <td class="no">{row.number}</td>
                        <What row={row} />
                        {[0, 1, 2].map(motor => (
                            <Cell key={motor} row={row} motor={motor} value={axisValue(row, motor)} />
                        ))}
                        <Range row={row} />
                        <td class="acts">
                            {row.access.includes("E") && <KeepRow row={row} />}
                            <WhoWroteOf of={row.name} values={[0, 1, 2].map(motor => `ap[${row.number}][${motor}]`)} />
                        </td>
                    </tr>
                )}
            </Groups>
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
                    <th />
                </tr>
            </thead>
            <Groups titles={tables.value.global_groups} rows={rows} columns={5}>
                {row => (
                    <tr key={row.number} data-parameter={keyOf(row.bank, row.number)}>
                        <td class="no">{row.number}</td>
                        <What row={row} />
                        <Cell row={row} motor={0} value={globalValue(row)} />
                        <Range row={row} />
                        <td class="acts">
                            <WhoWrote value={`gp[${row.number}][0]`} />
                        </td>
                    </tr>
                )}
            </Groups>
        </table>
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
                <span class="keys">
                    {section.value === "axis" && (
                        <button
                            onClick={() => keep("store", allStored())}
                            {...unless(offline.value, "Store all axis parameters as they are now (STAP)")}
                        >
                            <Icon name="save" /> Store all
                        </button>
                    )}
                    {section.value === "axis" && (
                        <button
                            onClick={() => keep("restore", allStored())}
                            {...unless(offline.value, "Bring back all axis parameters as they are stored (RSAP)")}
                        >
                            <Icon name="undo" /> Restore all
                        </button>
                    )}
                    <button
                        onClick={() => exportSettings("tmcl")}
                        {...unless(offline.value, "All settings as TMCL source")}
                    >
                        Export .tmc
                    </button>
                    <button onClick={() => exportSettings("toml")} {...unless(offline.value, "All settings as TOML")}>
                        Export .toml
                    </button>
                    <button onClick={pickSettings} {...unless(offline.value, "Settings of a file into the module")}>
                        Import…
                    </button>
                </span>
            </div>
            <div class={`scroll ${powered.value && !stale.value ? "" : "dimmed"}`} tabIndex={0} aria-label="Values">
                <View />
            </div>
        </div>
    );
}
