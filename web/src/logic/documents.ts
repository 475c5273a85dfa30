// The editor's documents: text on disk, text on screen, drafts that outlive the page, changes from outside.
import { batch, computed, effect, signal } from "@preact/signals";
import type { Problem } from "../wire";
import { ask, connection, files, notify, onServerEvent, welcome } from "./app";
import { RefusedError } from "./connection";
import { choose } from "./confirm";
import { breakpoints, setBreakpoints } from "./debugger";
import { dropDraft, draftPaths, isDraft, keepDraft, takeDraft } from "./drafts";
import { onPage } from "./layout";
import { askText } from "./prompt";
import { remembered } from "./settings";

export type Outside = "changed" | "deleted" | null;

export class TextDocument {
    /** The text as on screen. */
    readonly text = signal("");
    /** The text as last read from or written to the disk. */
    readonly saved = signal("");
    readonly outside = signal<Outside>(null);
    readonly dirty = computed(() => this.text.value !== this.saved.value);
    stamp = "";
    newline: "\n" | "\r\n" = "\n";
    /** Puts a text on screen that did not come from the editor. */
    show: (text: string) => void = () => {};
    /** The end of the last save that was begun: one follows the other. */
    saving: Promise<unknown> = Promise.resolve();
    /** It is being renamed: what the folder says meanwhile is not for it. */
    moving = false;
    private draftTimer = 0;

    constructor(public path: string) {
        effect(() => {
            void this.text.value;
            void this.saved.value;
            clearTimeout(this.draftTimer);
            this.draftTimer = window.setTimeout(() => this.keepDraft(), 300);
        });
    }

    /** A text from disk or from a draft. */
    fill(text: string, saved: string, stamp: string): void {
        this.saved.value = saved;
        this.stamp = stamp;
        this.outside.value = null;
        this.text.value = text;
        this.show(text);
    }

    keepDraft(): void {
        clearTimeout(this.draftTimer);
        if (!this.dirty.value) dropDraft(this.path);
        else if (!keepDraft(this.path, this.text.value, this.stamp))
            notify("warning", "The browser's store is full: unsaved texts are kept only while this window is open.");
    }

    forgetDraft(): void {
        clearTimeout(this.draftTimer);
        dropDraft(this.path);
    }
}

/** Pages in the main area that are not files. */
export const PAGES = {
    parameters: "Parameters",
    tools: "Tools",
    listing: "Listing",
    compare: "Compare",
    connection: "Connection",
    start: "Start",
    guide: "Guide",
} as const;
export type PageName = keyof typeof PAGES;
export interface Tab {
    kind: "file" | PageName;
    path: string;
}

/** Benches, notes and tables are no programs. */
export const isProgram = (path: string): boolean => !/\.(toml|md|csv)$/i.test(path);

export const documents = signal<ReadonlyMap<string, TextDocument>>(new Map());
export const tabs = remembered<Tab[]>("tabs", []);
export const active = remembered<string>("active", "");
export const mainFile = remembered<string>("main", "");
/** Where the editor is to go: set by problem lists and the debugger, taken by the editor. */
export const goal = signal<{ path: string; line: number; column: number; caret: () => boolean } | null>(null);

/** Whether what opens later may take the caret: not once a person has gone to another field, as while a module is read. */
export function caretIsFree(): () => boolean {
    const before = globalThis.document.activeElement;
    return () => {
        const now = globalThis.document.activeElement;
        return now === before || !now?.matches("input, select, textarea");
    };
}

/** Diagnostics by path. */
export const problems = signal<ReadonlyMap<string, Problem[]>>(new Map());
export const problemCount = computed(() => {
    let errors = 0;
    let warnings = 0;
    for (const list of problems.value.values())
        for (const problem of list)
            problem.severity === "error" ? errors++ : problem.severity === "warning" && warnings++;
    return { errors, warnings };
});

const keyOf = (tab: Tab): string => (tab.kind === "file" ? tab.path : `:${tab.kind}`);
export const activeTab = computed(() => tabs.value.find(tab => keyOf(tab) === active.value) ?? null);
export const activeDocument = computed(() => documents.value.get(active.value) ?? null);
/** The program that Run and Assemble mean. */
export const target = computed(
    () =>
        mainFile.value || (activeTab.value?.kind === "file" && isProgram(active.value) ? active.value : lastFile.value),
);
const lastFile = signal("");
/** What was to be opened at first is open. */
export const opened = signal(false);
/** A page, not a file, is in front, or will be when what is to be opened at first is open. */
function pageInFront(): boolean {
    if (opened.value) return activeTab.value?.kind !== "file";
    return active.value ? active.value.startsWith(":") : !welcome.value?.open.length;
}
effect(() => {
    if (activeTab.value?.kind === "file" && isProgram(active.value)) lastFile.value = active.value;
    onPage.value = pageInFront();
});

export function openPage(kind: PageName): void {
    if (!tabs.value.some(tab => tab.kind === kind)) tabs.value = [...tabs.value, { kind, path: "" }];
    active.value = `:${kind}`;
}

/** A file with a tab of its own, which need not be in front. */
async function add(path: string, inFront: boolean): Promise<TextDocument | null> {
    const document = documents.value.get(path) ?? (await load(path));
    if (!document) return null;
    batch(() => {
        if (inFront) active.value = path;
        if (!tabs.value.some(tab => tab.kind === "file" && tab.path === path))
            tabs.value = [...tabs.value, { kind: "file", path }];
    });
    return document;
}

export async function openFile(path: string, line = 0, column = 1): Promise<TextDocument | null> {
    const caret = caretIsFree();
    const document = await add(path, true);
    if (!document) return null;
    if (line) goal.value = { path, line, column, caret };
    return document;
}

/** A new page with a text that is nowhere on disk yet. */
export async function newFile(text = "", wish = "program", caret = caretIsFree()): Promise<TextDocument> {
    await restored;
    let path = `${wish}.tmc`;
    const taken = (name: string) =>
        documents.value.has(name) || isDraft(name) || files.value.some(file => file.path === name);
    for (let n = 2; taken(path); n++) path = `${wish}${n}.tmc`;
    const document = new TextDocument(path);
    keep(document);
    document.fill(text, "", "");
    batch(() => {
        tabs.value = [...tabs.value, { kind: "file", path }];
        active.value = path;
        goal.value = { path, line: 1, column: 1, caret };
    });
    return document;
}

/** A text that may be on the disk already; what is open or on the disk is shown as it is. */
export async function openText(path: string, text: string): Promise<void> {
    await restored;
    if (documents.value.has(path) || files.value.some(file => file.path === path)) return void (await openFile(path));
    const document = new TextDocument(path);
    keep(document);
    document.fill(text, "", "");
    await openFile(path);
}

function keep(document: TextDocument): void {
    documents.value = new Map(documents.value).set(document.path, document);
}

async function load(path: string): Promise<TextDocument | null> {
    const draft = await takeDraft(path);
    try {
        const file = await connection.call({ call: "read_file", path });
        const document = new TextDocument(path);
        document.newline = file.newline;
        keep(document);
        document.fill(draft?.text ?? file.text, file.text, file.stamp);
        if (draft && draft.stamp !== file.stamp && draft.text !== file.text) document.outside.value = "changed";
        return document;
    } catch (error) {
        if (!(error instanceof RefusedError)) throw error;
        if (!draft) {
            if (error.code !== "offline") notify("error", error.message);
            return null;
        }
        const document = new TextDocument(path);
        keep(document);
        document.fill(draft.text, "", "");
        document.outside.value = draft.stamp ? "deleted" : null;
        return document;
    }
}

/** Save after what is being saved; what is on the disk already is not written again. */
export function save(document: TextDocument, force = false): Promise<boolean> {
    const saved = document.saving.then(() => writeFile(document, force));
    document.saving = saved;
    return saved;
}

async function writeFile(document: TextDocument, force: boolean): Promise<boolean> {
    if (document.stamp && !document.dirty.value && !force) return true;
    try {
        const text = document.text.value;
        const stamp = force ? "*" : document.stamp;
        const entry = await connection.call({
            call: "write_file",
            path: document.path,
            text,
            stamp,
            newline: document.newline,
        });
        document.stamp = entry.stamp;
        document.saved.value = text;
        document.outside.value = null;
        document.keepDraft();
        return true;
    } catch (error) {
        if (!(error instanceof RefusedError)) throw error;
        if (error.code === "changed") document.outside.value = "changed";
        else notify("error", `${document.path} was not saved: ${error.message}`);
        return false;
    }
}

/** Write the text under another name, and go on there; a page that was nowhere on disk is closed. */
export async function saveAs(document: TextDocument): Promise<void> {
    const path = await askText("Save as", "Path in the opened folder", document.path, "Save");
    if (!path) return;
    if (path === document.path) return void save(document);
    if (documents.value.has(path)) return notify("error", `${path} is open already.`);
    const call = { call: "write_file", path, text: document.text.value, newline: document.newline } as const;
    try {
        await connection.call({ ...call, stamp: "" });
    } catch (error) {
        if (!(error instanceof RefusedError)) throw error;
        if (error.code !== "changed") return notify("error", `${path} was not saved: ${error.message}`);
        const answer = await choose(`${path} is there already`, "Saving writes over it.", [
            { id: "replace", title: "Write over it", tone: "danger" },
        ]);
        if (answer !== "replace" || !(await ask({ ...call, stamp: "*" }))) return;
    }
    if (!document.stamp) closeTab(document.path, true);
    await openFile(path);
}

export async function saveAll(): Promise<void> {
    for (const document of documents.value.values()) if (document.dirty.value) await save(document);
}

export async function reload(document: TextDocument): Promise<void> {
    const file = await ask({ call: "read_file", path: document.path });
    if (!file) return;
    document.newline = file.newline;
    document.fill(file.text, file.text, file.stamp);
    document.forgetDraft();
}

/** The file has another text on the disk: show it, unless something was typed. */
async function refresh(document: TextDocument): Promise<void> {
    await document.saving;
    const before = document.text.value;
    const file = await connection.call({ call: "read_file", path: document.path }).catch(() => null);
    if (!file) return;
    if (file.text === document.saved.value) document.stamp = file.stamp;
    else if (document.dirty.value || document.text.value !== before) document.outside.value = "changed";
    else {
        document.newline = file.newline;
        document.fill(file.text, file.text, file.stamp);
    }
}

export async function rename(path: string, to: string): Promise<void> {
    const document = documents.value.get(path);
    if (documents.value.has(to)) return notify("error", `${to} is open already.`);
    if (document) document.moving = true;
    try {
        await document?.saving;
        if (document?.stamp !== "") await connection.call({ call: "rename_file", path, to });
        else if (files.value.some(file => file.path === to))
            throw new RefusedError("exists", `${to} is there already.`);
    } catch (error) {
        if (!(error instanceof RefusedError)) throw error;
        return notify("error", error.message);
    } finally {
        if (document) document.moving = false;
    }
    if (document) {
        document.forgetDraft();
        const map = new Map(documents.value);
        map.delete(path);
        document.path = to;
        document.outside.value = null;
        document.keepDraft();
        documents.value = map.set(to, document);
    }
    tabs.value = tabs.value.map(tab => (tab.path === path ? { ...tab, path: to } : tab));
    if (active.value === path) active.value = to;
    if (mainFile.value === path) mainFile.value = to;
    void setBreakpoints(breakpoints.value.map(point => (point.path === path ? { ...point, path: to } : point)));
}

/** Close a tab; unsaved text stays as a draft unless `discard`. */
export function closeTab(key: string, discard = false): void {
    const at = tabs.value.findIndex(tab => keyOf(tab) === key);
    if (at < 0) return;
    const document = documents.value.get(key);
    if (document && discard) document.forgetDraft();
    else document?.keepDraft();
    if (document?.dirty.value && !discard)
        notify("information", `${key} is closed; its unsaved text is kept.`, {
            title: "Open again",
            run: () => void openFile(key),
        });
    tabs.value = tabs.value.filter(tab => keyOf(tab) !== key);
    const map = new Map(documents.value);
    map.delete(key);
    documents.value = map;
    const next = tabs.value[Math.min(at, tabs.value.length - 1)];
    if (active.value === key) active.value = next ? keyOf(next) : "";
}

/** Texts on screen that differ from the disk: the assembler reads them first. */
export function screenTexts(): Record<string, string> {
    const texts: Record<string, string> = {};
    for (const document of documents.value.values())
        if (document.dirty.value) texts[document.path] = document.text.value;
    return texts;
}

const lastStart = remembered("start", "");
const restored = new Promise<void>(done =>
    effect(() => {
        if (opened.value) done();
    }),
);

/** At the first contact: what was open here before, drafts, and what the server was started with. */
export async function restore(): Promise<void> {
    const known = tabs.value;
    const before = active.value;
    tabs.value = [];
    const drafts = await draftPaths();
    const listed = new Set((await ask({ call: "list_files" }))?.map(file => file.path) ?? []);
    let last = "";
    for (const tab of known) {
        if (tab.kind !== "file") tabs.value = [...tabs.value.filter(({ kind }) => kind !== tab.kind), tab];
        else if (listed.has(tab.path) || drafts.includes(tab.path)) last = (await add(tab.path, false))?.path ?? last;
    }
    const { start, open } = welcome.value!;
    for (const path of [...drafts, ...open]) if (path) last = (await add(path, false))?.path ?? last;
    const again = start === lastStart.value;
    lastStart.value = start;
    const stays = (again || !open.length) && tabs.value.some(tab => keyOf(tab) === before);
    // What a person has put in front meanwhile stays there.
    if (active.value === before && !stays && last) active.value = last;
    if (!listed.has(mainFile.value) || (!again && open.length)) mainFile.value = "";
    opened.value = true;
}

onServerEvent(event => {
    if (event.event !== "files_changed") return;
    const stamps = new Map(event.files.map(file => [file.path, file.stamp]));
    for (const document of documents.value.values()) {
        if (!document.stamp || document.moving) continue;
        const stamp = stamps.get(document.path);
        if (stamp === undefined) document.outside.value = "deleted";
        else if (stamp === document.stamp) document.outside.value = null;
        else void refresh(document);
    }
});

window.addEventListener("pagehide", () => {
    for (const document of documents.value.values()) document.keepDraft();
});
