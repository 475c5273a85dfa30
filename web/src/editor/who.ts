// An action beside what a command of the source names: who wrote that value last?
import type { Extension } from "@codemirror/state";
import { hoverTooltip } from "@codemirror/view";
import { can } from "../logic/app";
import { whoWrote } from "../logic/past";

const NAMES: Record<string, string> = {
    SGP: "gp",
    GGP: "gp",
    AGP: "gp",
    SAP: "ap",
    GAP: "ap",
    AAP: "ap",
    SCO: "co",
    GCO: "co",
    CCO: "co",
    ACO: "co",
    SIO: "out",
};
const COMMAND = /\b([SGA][GA]P|[SGCA]CO|SIO)\s+([\w$.]+)\s*,\s*([\w$.]+)/i;
const MOVE = /\bMVP\s+COORD\s*,\s*([\w$.]+)\s*,\s*([\w$.]+)/i;

/** The value that a command in a line names, as the debugger calls it; empty for none. */
export function valueIn(line: string): string {
    const text = line.replace(/\/\/.*/, "");
    const move = MOVE.exec(text);
    if (move) return `co[${move[2]}][${move[1]}]`;
    const found = COMMAND.exec(text);
    const name = found && NAMES[found[1]!.toUpperCase()];
    if (!found || !name) return "";
    return name === "out" ? `out[${found[2]}]` : `${name}[${found[2]}][${found[3]}]`;
}

/** A button in the hover of a line. */
export const who = (): Extension =>
    hoverTooltip((view, position) => {
        const line = view.state.doc.lineAt(position);
        const value = can.value.history ? valueIn(line.text) : "";
        if (!value) return null;
        return {
            pos: position,
            above: true,
            create: () => {
                const dom = document.createElement("div");
                dom.className = "who-wrote";
                const button = dom.appendChild(document.createElement("button"));
                button.textContent = `Who wrote ${value}?`;
                button.onclick = () => void whoWrote(value);
                return { dom };
            },
        };
    });
