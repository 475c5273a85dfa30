// Actions of debugging, of comparing and of building: rows of ACTIONS.
import type { Action } from "./actions";
import { can, online } from "./app";
import { compare } from "./compare";
import { counting, coverageSource, hideCoverage, pickTracefile, toggleCounting } from "./coverage";
import { exportSettings, pickSettings } from "./exchange";
import { activeDocument, openPage, saveAs, target } from "./documents";
import { showRight } from "./layout";
import { followOn, liveOn } from "./live";
import { tool } from "./views";

const program = (): boolean => online.value && !!target.value;

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
        enabled: () => can.value.peek,
        on: () => liveOn.value,
        run: () => (liveOn.value = !liveOn.value),
    },
    {
        id: "coverage",
        title: "Count coverage of the live program",
        group: "Program",
        keys: ["Alt+C"],
        enabled: () => online.value && can.value.bench,
        on: () => counting.value,
        run: toggleCounting,
    },
    {
        id: "tracefile",
        title: "Show coverage of a tracefile\u2026",
        group: "Program",
        enabled: () => online.value,
        run: pickTracefile,
    },
    {
        id: "hide_coverage",
        title: "Hide coverage",
        group: "Program",
        enabled: () => !!coverageSource.value,
        run: hideCoverage,
    },
    {
        id: "compare_module",
        title: "Compare with the program in the module",
        group: "Program",
        keys: ["Alt+M"],
        enabled: program,
        run: () => compare("module"),
    },
    {
        id: "compare_disk",
        title: "Compare with the file on the disk",
        group: "File",
        keys: ["Alt+D"],
        enabled: program,
        run: () => compare("disk"),
    },
    {
        id: "save_as",
        title: "Save as\u2026",
        group: "File",
        keys: ["Ctrl+Alt+S"],
        enabled: () => !!activeDocument.value,
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
        enabled: () => online.value,
        run: () => exportSettings("tmcl"),
    },
    {
        id: "export_toml",
        title: "Export settings as TOML",
        group: "Module",
        enabled: () => online.value,
        run: () => exportSettings("toml"),
    },
    {
        id: "import_settings",
        title: "Import settings\u2026",
        group: "Module",
        enabled: () => online.value,
        run: pickSettings,
    },
];
