// A table of the motion chip that is changed as a draft and sent after a summary.
import { useSignal } from "@preact/signals";
import { useEffect } from "preact/hooks";
import { cells, keepTable, readTable, writeTable, type TableName } from "../../logic/chip_tables";
import { Empty } from "../../widgets/basics";
import { offline, unless } from "../../logic/hindrance";

export type Draft = {
    name: TableName;
    /** As last read from the module. */
    known: number[];
    /** With the changes that are not sent. */
    shown: number[];
    /** How many cells are not sent. */
    changed: number;
    /** Whether there is a draft, if only one that differs in nothing. */
    begun: boolean;
    set: (at: number, value: number) => void;
    /** Take a whole table as the draft; null drops it. */
    take: (table: number[] | null) => void;
};

/** The draft of a table; null while the module has not sent the table, which is read first. */
export function useDraft(name: TableName): Draft | null {
    const known = cells.value[name];
    const draft = useSignal<number[] | null>(null);
    useEffect(() => void readTable(name), []);
    if (!known) return null;
    const shown = draft.value ?? known;
    return {
        name,
        known,
        shown,
        changed: shown.filter((value, at) => value !== known[at]).length,
        begun: draft.value !== null,
        set: (at, value) => (draft.value = shown.map((old, n) => (n === at ? value : old))),
        take: table => (draft.value = table),
    };
}

/** In place of a table that the module has not sent. */
export const NotRead = (props: { icon: string; name: TableName; what: string }) => (
    <Empty icon={props.icon} title="Not read yet">
        <button class="link" {...unless(offline.value)} onClick={() => readTable(props.name)}>
            Read the {props.what} of the module
        </button>
    </Empty>
);

/** Sending a draft, dropping it, and the table in the EEPROM. */
export function Apply({ draft, title }: { draft: Draft; title: string }) {
    const { name, shown, changed } = draft;
    const unchanged = !changed && "Nothing differs from the module";
    const send = async () => {
        await writeTable(name, shown, title);
        if (shown.every((cell, at) => cell === cells.peek()[name]?.[at])) draft.take(null);
    };
    return (
        <div class="row">
            <button class="primary" {...unless(offline.value || unchanged)} onClick={send}>
                Apply…
            </button>
            <button {...unless(!draft.begun && "There is no draft")} onClick={() => draft.take(null)}>
                Drop the draft
            </button>
            <span class={`pill ${changed ? "warn" : ""}`}>
                {changed ? `${changed} ${changed === 1 ? "cell is" : "cells are"} not sent` : "as in the module"}
            </span>
            <span class="keys">
                <button {...unless(offline.value)} onClick={() => readTable(name)}>
                    Read again
                </button>
                <button
                    {...unless(
                        offline.value || (changed > 0 && "Send or drop the draft first"),
                        "STGP: the whole table into the EEPROM",
                    )}
                    onClick={() => keepTable(name, "STGP")}
                >
                    Store
                </button>
                <button
                    {...unless(offline.value, "RSGP: the whole table out of the EEPROM")}
                    onClick={() => keepTable(name, "RSGP")}
                >
                    Restore
                </button>
            </span>
        </div>
    );
}
