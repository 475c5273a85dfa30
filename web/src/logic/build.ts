// From source text to a running program: live checking, assembling, downloading, uploading; the language server.
import { effect, signal } from "@preact/signals";
import { languageServer } from "../editor/server";
import type { Assembled, Call } from "../wire";
import { ask, connection, forget, loaded, notify, onServerEvent, online } from "./app";
import { choose } from "./confirm";
import { RefusedError } from "./connection";
import { options } from "./options";
import {
    active,
    caretIsFree,
    documents,
    isProgram,
    newFile,
    openFile,
    problems,
    saveAll,
    screenTexts,
    target,
} from "./documents";

/** Last result of the assembler by path. */
export const assembled = signal<ReadonlyMap<string, Assembled>>(new Map());
export const busy = signal("");

function keep(path: string, result: Assembled, show: boolean): void {
    assembled.value = new Map(assembled.value).set(path, result);
    const map = new Map(problems.value);
    const others = new Set(result.problems.map(problem => problem.place.path));
    for (const name of [path, ...others]) {
        if (languageServer.value && documents.value.has(name)) continue;
        map.set(
            name,
            result.problems.filter(problem => problem.place.path === name),
        );
    }
    problems.value = map;
    if (result.listing) forget("assembly");
    if (show && !result.listing) {
        const first = result.problems.find(problem => problem.severity === "error");
        if (first) {
            const { path: where, line, column } = first.place;
            void openFile(where, line, column);
            notify("error", `${where}:${line}: ${first.text}`, undefined, "assembly");
        }
    }
}

function needProgram(): string {
    if (!target.value) notify("information", "Open a program first, or make a new one.");
    return target.value;
}

export async function assemble(): Promise<Assembled | null> {
    const path = needProgram();
    if (!path) return null;
    busy.value = "Assembling";
    const result = await ask({ call: "assemble", path, texts: screenTexts(), options: options.value });
    busy.value = "";
    if (!result) return null;
    keep(path, result, true);
    if (result.listing) notify("information", `${path}: ${result.listing.lines.length} instructions, no errors.`);
    return result;
}

/** Store the program in the module, and start it if asked. */
export async function download(run: boolean): Promise<Assembled | null> {
    const path = needProgram();
    if (!path) return null;
    await saveAllKnown();
    const result = await store({ call: "download", path, texts: screenTexts(), run, options: options.value });
    if (!result) return null;
    keep(path, result, true);
    if (result.listing && !run) notify("information", `${result.listing.lines.length} instructions are in the module.`);
    return result;
}

/** Download; over a program that was not loaded here only after a confirmation. */
async function store(call: Call & { call: "download" }): Promise<Assembled | null> {
    busy.value = "Downloading";
    try {
        return await connection.call(call);
    } catch (error) {
        if (!(error instanceof RefusedError)) throw error;
        if (error.code !== "unknown") {
            notify("error", error.message, undefined, error.code);
            return null;
        }
    } finally {
        busy.value = "";
    }
    const answer = await choose(
        "Another program is in the module",
        "This IDE has not loaded the program that the module holds. A download erases it. Upload it first to keep it as a text.",
        [
            { id: "upload", title: "Upload it first", tone: "primary" },
            { id: "replace", title: "Replace it", tone: "danger" },
        ],
    );
    if (answer === "upload") await upload();
    return answer === "replace" ? store({ ...call, replace: true }) : null;
}

/** Files that are on the disk already are saved before a download; new texts stay where they are. */
async function saveAllKnown(): Promise<void> {
    const fresh = [...documents.value.values()].some(document => !document.stamp);
    if (!fresh) await saveAll();
}

/** Run from the start; downloads first when the source has changed since. */
export async function run(): Promise<void> {
    await download(true);
}

export async function upload(): Promise<void> {
    busy.value = "Reading the module";
    const caret = caretIsFree();
    const text = await ask({ call: "upload" });
    busy.value = "";
    if (text === null) return;
    if (text.trim()) {
        const { path } = await newFile(text, "uploaded", caret);
        await adopt(path);
    } else notify("information", "The module's program memory is empty.");
}

/** The text of `path` is what the module holds: it gets the running line and breakpoints. */
async function adopt(path: string): Promise<void> {
    const known = await ask({ call: "adopt", path, texts: screenTexts(), options: options.value });
    if (known === false)
        notify(
            "warning",
            "The uploaded text does not assemble to what the module holds: running line and breakpoints are not shown in it.",
        );
}

// Another host has changed the program: its text is in the folder, or can be made of the memory.
onServerEvent(event => {
    if (event.event !== "loaded" || !event.by_other_host) return;
    const path = event.listing?.path;
    const action = path
        ? { title: "Open it", run: () => void openFile(path) }
        : { title: "Upload it", run: () => void upload() };
    const text = path
        ? `It is ${path}.`
        : event.listing
          ? "No file in this folder matches it."
          : "The previous one is no longer there.";
    notify("information", `Another host has changed the program in the module. ${text}`, action, "other-host");
});

/** The source differs from what the module holds. */
export const changedSinceDownload = (): boolean => {
    const now = assembled.value.get(target.value)?.listing;
    return !!loaded.value && !!now && now.identity !== loaded.value.identity;
};

// ------------------------------------------------------------------ checking while typing
let checkTimer = 0;
effect(() => {
    const shown = documents.value.get(active.value);
    const document = shown && isProgram(shown.path) ? shown : documents.value.get(target.value);
    if (!document || !online.value) return;
    void document.text.value;
    void options.value;
    clearTimeout(checkTimer);
    checkTimer = window.setTimeout(() => void check(document.path), 250);
});

async function check(path: string): Promise<void> {
    if (!online.value) return;
    const texts = { ...screenTexts(), [path]: documents.value.get(path)?.text.value ?? "" };
    const result = await ask({ call: "assemble", path, texts, options: options.value });
    if (result) keep(path, result, false);
}
