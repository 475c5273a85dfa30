// Everything the page can do: one row each. Tool bar, key bindings, palette and overview read it.
import { question } from "./confirm";
import { signal } from "@preact/signals";
import { find, toggleHere } from "../editor/editor";
import { showHints } from "../editor/server";
import { ask, can, held, inRoutine, running, send, stopAll, timePaused, welcome } from "./app";
import { assemble, download, run, upload } from "./build";
import { DEBUG_ACTIONS } from "./debug_actions";
import { go } from "./debugger";
import {
    active,
    activeDocument,
    activeTab,
    closeTab,
    mainFile,
    newFile,
    openPage,
    save,
    saveAll,
    type PageName,
} from "./documents";
import { beginTour } from "./tour";
import { layout, lowerPanel, palette, right, showBottom, showRight, theme } from "./layout";
import { shownTheme } from "./theme";
import { past } from "./past";
import { PAST_ACTIONS } from "./past_actions";
import type { ControlProgram } from "../wire";
import { type Hindrance, inThePast, NO_FILE, noBench, noDocument, offline, runs, unfree, working } from "./hindrance";

export interface Action {
    id: string;
    title: string;
    group: "Program" | "Module" | "File" | "View";
    /** As in `Ctrl+Shift+S`; the first is shown. */
    keys?: string[];
    icon?: string;
    hint?: string;
    /** What keeps it from being done now; empty where nothing does. */
    hindrance?: () => Hindrance;
    /** Of a switch: whether it is on. */
    on?: () => boolean;
    run: () => unknown;
}

const control = (action: ControlProgram["action"]) => () => ask({ call: "control_program", action });
const noServer = () => offline.value;
const unlessPast = () => offline.value || inThePast.value;
const unlessBuilding = () => working.value || inThePast.value;
const unlessRuns = () => unfree.value || runs.value;

/** What F9 does: go on when the program is held or a past moment is shown, else start it. */
const runOrContinue = () => (held.value || past.value ? go("continue") : run());

export const ACTIONS: Action[] = [
    {
        id: "run",
        title: "Run",
        group: "Program",
        keys: ["F9"],
        icon: "play",
        hindrance: () => unfree.value,
        hint: "Assemble, download and run from the start; continues when held; in the past, along the recording",
        run: runOrContinue,
    },
    {
        id: "stop",
        title: "Stop",
        group: "Program",
        keys: ["Ctrl+F2"],
        icon: "stop",
        hindrance: unlessPast,
        hint: "Stop the program; motors keep turning",
        run: control("stop"),
    },
    {
        id: "continue",
        title: "Continue",
        group: "Program",
        keys: ["Shift+F9"],
        icon: "continue",
        hindrance: unlessRuns,
        hint: "Continue from the next instruction",
        run: () => go("continue"),
    },
    {
        id: "pause",
        title: "Pause",
        group: "Program",
        keys: ["F2"],
        icon: "pause",
        hindrance: () => offline.value || (!running.value && "The program does not run"),
        hint: "Hold the program at its next instruction",
        run: () => go("pause"),
    },
    {
        id: "step",
        title: "Step",
        group: "Program",
        keys: ["F7"],
        icon: "step",
        hindrance: unlessRuns,
        hint: "Execute one instruction",
        run: () => go("stepIn"),
    },
    {
        id: "step_over",
        title: "Step over CSUB",
        group: "Program",
        keys: ["Shift+F7"],
        icon: "step-over",
        hindrance: unlessRuns,
        hint: "Execute one instruction, a CSUB with all that it calls",
        run: () => go("next"),
    },
    {
        id: "step_out",
        title: "Step out of CSUB",
        group: "Program",
        keys: ["Ctrl+F7"],
        icon: "step-out",
        hindrance: () => unlessRuns() || (!inRoutine.value && can.value.debug && "No CSUB is open"),
        hint: "Continue until the CSUB has returned",
        run: () => go("stepOut"),
    },
    ...PAST_ACTIONS,
    {
        id: "reset",
        title: "Reset",
        group: "Program",
        keys: ["Ctrl+Shift+F2"],
        icon: "reset",
        hindrance: unlessPast,
        hint: "Stop, and go back to the first instruction",
        run: control("reset"),
    },
    {
        id: "breakpoint",
        title: "Toggle breakpoint",
        group: "Program",
        keys: ["F8"],
        icon: "breakpoint",
        hindrance: noServer,
        run: toggleHere,
    },
    {
        id: "assemble",
        title: "Assemble",
        group: "Program",
        keys: ["F4"],
        icon: "assemble",
        hindrance: () => working.value,
        hint: "Check the program and assemble it",
        run: assemble,
    },
    {
        id: "download",
        title: "Download",
        group: "Program",
        keys: ["F6"],
        icon: "download",
        hindrance: unlessBuilding,
        hint: "Store the program in the module without starting it",
        run: () => download(false),
    },
    {
        id: "upload",
        title: "Upload and disassemble",
        group: "Program",
        icon: "upload",
        hindrance: unlessBuilding,
        hint: "Read the module's program memory into a new page",
        run: upload,
    },
    {
        id: "main_file",
        title: "Set or clear the main file",
        group: "Program",
        hint: "The file that Run means, whatever page is open",
        hindrance: () => activeTab.value?.kind !== "file" && !mainFile.value && NO_FILE,
        run: () => (mainFile.value = mainFile.value ? "" : active.value),
    },

    {
        id: "stop_all",
        title: "STOP ALL",
        group: "Module",
        keys: ["F10"],
        icon: "stop",
        hint: "Stop the program and all motors",
        hindrance: noServer,
        run: stopAll,
    },
    ...[0, 1, 2].map(
        (motor): Action => ({
            id: `stop_motor_${motor}`,
            title: `Stop motor ${motor}`,
            group: "Module",
            keys: [`Alt+${motor + 1}`],
            hindrance: noServer,
            run: () => send("MST", 0, motor),
        }),
    ),
    {
        id: "pause_time",
        title: "Hold or release time",
        group: "Module",
        keys: ["Ctrl+F9"],
        hint: "Hold the virtual module and its bench",
        hindrance: () => noBench.value,
        run: () => ask({ call: "set_time", paused: !timePaused.value }),
    },
    {
        id: "step_time",
        title: "Advance time by one millisecond",
        group: "Module",
        keys: ["Ctrl+F10"],
        hindrance: () => noBench.value,
        run: () => ask({ call: "step_time", ms: 1 }),
    },

    { id: "new", title: "New program", group: "File", keys: ["Alt+N"], icon: "plus", run: () => newFile() },
    {
        id: "open",
        title: "Open a file or do anything…",
        group: "File",
        keys: ["Ctrl+P", "Ctrl+K"],
        icon: "search",
        run: () => (palette.value = ""),
    },
    {
        id: "save",
        title: "Save",
        group: "File",
        keys: ["Ctrl+S"],
        icon: "save",
        hindrance: () => noDocument.value,
        run: () => activeDocument.value && save(activeDocument.value),
    },
    { id: "save_all", title: "Save all", group: "File", keys: ["Ctrl+Shift+S"], run: saveAll },
    {
        id: "close",
        title: "Close the page",
        group: "File",
        keys: ["Alt+W"],
        hindrance: () => !active.value && "No page is open",
        run: () => closeTab(active.value),
    },
    { id: "find", title: "Find and replace", group: "File", keys: ["Ctrl+F"], run: find },

    ...(
        [
            ["axes", "Axes"],
            ["bench", "Bench"],
            ["program", "Program"],
        ] as const
    ).map(
        ([id, title], at): Action => ({
            id: `show_${id}`,
            title: `Show ${title}`,
            group: "View",
            keys: [`Ctrl+Alt+${at + 1}`],
            run: () => showRight(id),
        }),
    ),
    {
        id: "show_machine",
        title: "Show Machine",
        group: "View",
        keys: ["Ctrl+Alt+M"],
        hindrance: () => noBench.value,
        run: () => showRight("machine"),
    },
    ...(
        [
            ["plot", "Plot"],
            ["direct", "Direct mode"],
            ["log", "Telegrams"],
            ["problems", "Problems"],
        ] as const
    ).map(
        ([id, title], at): Action => ({
            id: `show_${id}`,
            title: `Show ${title}`,
            group: "View",
            keys: [`Ctrl+Alt+${at + 4}`],
            run: () => showBottom(id),
        }),
    ),
    ...(
        [
            ["parameters", "Parameters"],
            ["tools", "Tools"],
            ["listing", "Listing"],
        ] as const
    ).map(
        ([id, title], at): Action => ({
            id: `show_${id}`,
            title: `Show ${title}`,
            group: "View",
            keys: [`Ctrl+Alt+${["8", "9", "0"][at]}`],
            run: () => openPage(id as PageName),
        }),
    ),
    { id: "connect", title: "Connect to a module…", group: "Module", icon: "plug", run: () => openPage("connection") },
    { id: "start", title: "Start page and examples", group: "View", run: () => openPage("start") },
    { id: "tour", title: "Take the tour", group: "View", run: beginTour },
    {
        id: "toggle_files",
        title: "Show or hide files",
        group: "View",
        keys: ["Ctrl+B"],
        run: () => (layout.value = { ...layout.value, files: !layout.value.files }),
    },
    {
        id: "toggle_bottom",
        title: "Show or hide the lower panel",
        group: "View",
        keys: ["Ctrl+J"],
        run: () => (lowerPanel().value = lowerPanel().value ? "" : "plot"),
    },
    {
        id: "toggle_right",
        title: "Show or hide the right panel",
        group: "View",
        keys: ["Ctrl+Shift+J"],
        run: () => (right.value = right.value ? "" : "axes"),
    },
    {
        id: "hints",
        title: "Show or hide hints in the source",
        group: "View",
        keys: ["Alt+H"],
        run: () => (showHints.value = !showHints.value),
    },
    {
        id: "theme",
        title: "Change between dark and light",
        group: "View",
        keys: ["Alt+T"],
        icon: "theme",
        run: () => (theme.value = shownTheme() === "dark" ? "light" : "dark"),
    },
    {
        id: "keys",
        title: "Keyboard shortcuts",
        group: "View",
        keys: ["F1"],
        icon: "help",
        run: () => (overview.value = !overview.value),
    },
];

ACTIONS.push(...DEBUG_ACTIONS);

export const overview = signal(false);

const BY_ID = new Map(ACTIONS.map(action => [action.id, action]));
const BY_KEYS = new Map(ACTIONS.flatMap(action => (action.keys ?? []).map(keys => [keys, action] as const)));

export const action = (id: string): Action => BY_ID.get(id)!;
export function perform(id: string): void {
    const found = action(id);
    if (welcome.value && !found.hindrance?.()) void found.run();
}

/** `Ctrl+Shift+S` for an event of these keys. */
export function keysOf(event: KeyboardEvent): string {
    const name = event.code.startsWith("Digit")
        ? event.code.slice(5)
        : event.code.startsWith("Key")
          ? event.code.slice(3)
          : event.key;
    const control = event.ctrlKey || event.metaKey;
    return [control && "Ctrl", event.altKey && "Alt", event.shiftKey && "Shift", name].filter(Boolean).join("+");
}

/** A key that is held repeats steps and nothing else; a question on the screen is answered before anything but a stop. */
function allowed({ id }: Action, repeated: boolean): boolean {
    if (repeated) return id.startsWith("step");
    return question.value === null || id.startsWith("stop");
}

window.addEventListener(
    "keydown",
    event => {
        const found = BY_KEYS.get(keysOf(event));
        if (!found || (found.id === "find" && !activeDocument.value)) return;
        event.preventDefault();
        event.stopPropagation();
        if (allowed(found, event.repeat)) perform(found.id);
    },
    { capture: true },
);
