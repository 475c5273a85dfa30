// Curves that have no button of their own.
import { useSignal } from "@preact/signals";
import { WATCH_SLOTS, setWatches, tables, watches } from "../../logic/app";
import { Menu } from "../../widgets/basics";
import type { Parameter } from "../../wire";
import { FIRST, offered, shownKinds, toggle } from "./curves";

/** Curves that are not always offered, and any parameter. */
export function MoreCurves() {
    const wish = useSignal("");
    const add = (bank: number, number: number, motor: number) =>
        setWatches([...watches.value, { bank, number, motor }]);
    const full = watches.value.length >= WATCH_SLOTS;
    const fits = (row: Parameter) =>
        row.access.includes("R") && `${row.number} ${row.name}`.toLowerCase().includes(wish.value.toLowerCase());
    return (
        <Menu icon="plus" class="chip add" label="More curves" tall>
            {offered()
                .filter(({ curve }) => !FIRST.has(curve))
                .map(({ curve, title }) => (
                    <div class="menu-row" key={curve}>
                        <span>{title}</span>
                        <button role="menuitem" onClick={() => (shownKinds.value = toggle(shownKinds.value, curve))}>
                            {shownKinds.value.includes(curve) ? "hide" : "show"}
                        </button>
                    </div>
                ))}
            <input
                placeholder="any parameter"
                aria-label="Search parameter"
                value={wish.value}
                onInput={event => (wish.value = event.currentTarget.value)}
            />
            {full && <p class="note">Eight parameters are plotted: remove one first.</p>}
            {!full &&
                tables.value.axis.filter(fits).map(row => (
                    <div class="menu-row" key={row.number}>
                        <span>
                            {row.number} {row.name}
                        </span>
                        {[0, 1, 2].map(motor => (
                            <button
                                key={motor}
                                role="menuitem"
                                class={`motor${motor}`}
                                aria-label={`Plot ${row.name} of motor ${motor}`}
                                onClick={() => add(-1, row.number, motor)}
                            >
                                {motor}
                            </button>
                        ))}
                    </div>
                ))}
            {!full &&
                tables.value.globals
                    .filter(row => fits(row) && (row.bank === 2 || row.number > 63 || row.number === 5))
                    .map(row => (
                        <div class="menu-row" key={row.key}>
                            <span>
                                {row.bank === 2 ? "" : `${row.number} `}
                                {row.name}
                            </span>
                            <button role="menuitem" onClick={() => add(row.bank, row.number, 0)}>
                                add
                            </button>
                        </div>
                    ))}
        </Menu>
    );
}
