// Actions of debugging, of comparing and of building: rows of ACTIONS.
import type { Action } from "./actions";
import { can } from "./app";
import { compare } from "./compare";
import { counting, coverageSource, hideCoverage, pickTracefile, toggleCounting } from "./coverage";
import { exportSettings, pickSettings } from "./exchange";
import { activeDocument, openPage, saveAs } from "./documents";
import { showRight } from "./layout";
import { followOn, liveOn } from "./live";
import { tool } from "./views";
import { noBench, noDocument, noProgram, notVirtual, offline } from "./hindrance";

const noServer = () => offline.value;
const unlessProgram = () => offline.value || noProgram.value;

function showTool(name: typeof tool.value): void {
    tool.value = name;
    openPage("tools");
}

export const DEBUG_ACTIONS: Action[] = [
    {
        id: "follow",
        title: "Follow the running line",
        group: "Program",
        keys: ["Alt+F"],
        icon: "follow",
        hint: "The editor keeps the line in view that the module executes",
        on: () => followOn.value,
        run: () => (followOn.value = !followOn.value),
    },
    {
        id: "live_values",
        title: "Values beside the lines",
        group: "Program",
        keys: ["Alt+V"],
        hint: "While the program is held or virtual time runs slowly",
        hindrance: () => notVirtual(can.value.peek),
        on: () => liveOn.value,
        run: () => (liveOn.value = !liveOn.value),
    },
    {
        id: "coverage",
        title: "Count coverage of the live program",
        group: "Program",
        keys: ["Alt+C"],
        hindrance: () => noBench.value,
        on: () => counting.value,
        run: toggleCounting,
    },
    {
        id: "tracefile",
        title: "Show coverage of a tracefile\u2026",
        group: "Program",
        hindrance: noServer,
        run: pickTracefile,
    },
    {
        id: "hide_coverage",
        title: "Hide coverage",
        group: "Program",
        hindrance: () => !coverageSource.value && "No coverage is shown",
        run: hideCoverage,
    },
    {
        id: "compare_module",
        title: "Compare with the program in the module",
        group: "Program",
        keys: ["Alt+M"],
        hindrance: unlessProgram,
        run: () => compare("module"),
    },
    {
        id: "compare_disk",
        title: "Compare with the file on the disk",
        group: "File",
        keys: ["Alt+D"],
        hindrance: unlessProgram,
        run: () => compare("disk"),
    },
    {
        id: "save_as",
        title: "Save as\u2026",
        group: "File",
        keys: ["Ctrl+Alt+S"],
        hindrance: () => noDocument.value,
        run: () => activeDocument.value && saveAs(activeDocument.value),
    },
    {
        id: "outline",
        title: "Show the outline",
        group: "View",
        keys: ["Ctrl+Shift+O"],
        run: () => showRight("outline"),
    },
    { id: "assembler_options", title: "Assembler options", group: "Program", run: () => showTool("assembler") },
    {
        id: "export_tmcl",
        title: "Export settings as TMCL source",
        group: "Module",
        hindrance: noServer,
        run: () => exportSettings("tmcl"),
    },
    {
        id: "export_toml",
        title: "Export settings as TOML",
        group: "Module",
        hindrance: noServer,
        run: () => exportSettings("toml"),
    },
    {
        id: "import_settings",
        title: "Import settings\u2026",
        group: "Module",
        hindrance: noServer,
        run: pickSettings,
    },
];
