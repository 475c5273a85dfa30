// Actions along the history of a virtual module: rows of ACTIONS.
import type { Action } from "./actions";
import { can } from "./app";
import { go } from "./debugger";
import { askText } from "./prompt";
import { goOn, leave, past, whoWrote } from "./past";
import { offline, runs } from "./hindrance";

const back = () => offline.value || (!can.value.history && "Only a virtual module has a history") || runs.value;
const unlessPresent = () => !past.value && "The present is shown";

async function ask(): Promise<void> {
    const value = await askText("Who wrote this?", "Value", "gp[3]", "Find the last write");
    if (value) await whoWrote(value);
}

export const PAST_ACTIONS: Action[] = [
    {
        id: "step_back",
        title: "Step back",
        group: "Program",
        keys: ["Alt+F7"],
        icon: "step-back",
        hindrance: back,
        hint: "Show the moment before the last command; a CSUB with all that it called counts as one",
        run: () => go("stepBack"),
    },
    {
        id: "reverse",
        title: "Reverse",
        group: "Program",
        keys: ["Alt+F9"],
        icon: "reverse",
        hindrance: back,
        hint: "Show where a breakpoint would have held last, or the beginning of the history",
        run: () => go("reverseContinue"),
    },
    {
        id: "live",
        title: "Back to the present",
        group: "Program",
        keys: ["Alt+F2"],
        hindrance: unlessPresent,
        run: leave,
    },
    {
        id: "go_on",
        title: "Continue from the past moment",
        group: "Program",
        hindrance: unlessPresent,
        run: () => goOn(false),
    },
    {
        id: "who_wrote",
        title: "Who wrote a value?",
        group: "Program",
        keys: ["Alt+F8"],
        hindrance: back,
        run: ask,
    },
];
