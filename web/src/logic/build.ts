// From source text to a running program: live checking, assembling, downloading, uploading; the language server.
import {
    LSPClient, LSPPlugin, findReferencesKeymap, formatKeymap, hoverTooltips, jumpToDefinitionKeymap, renameKeymap,
    serverCompletion, serverDiagnostics, signatureHelp, type Transport,
} from "@codemirror/lsp-client";
import type { Extension } from "@codemirror/state";
import { keymap } from "@codemirror/view";
import { effect, signal } from "@preact/signals";
import type { Assembled, Problem, Severity } from "../wire";
import { ask, can, loaded, notify, online, welcome } from "./app";
import { active, documents, newFile, openFile, problems, saveAll, screenTexts, target } from "./documents";

/** Last result of the assembler by path. */
export const assembled = signal<ReadonlyMap<string, Assembled>>(new Map());
export const busy = signal("");
/** The language server is connected: squiggles come from it. */
export const languageServer = signal<LSPClient | null>(null);

function keep(path: string, result: Assembled, show: boolean): void {
    assembled.value = new Map(assembled.value).set(path, result);
    const map = new Map(problems.value);
    const others = new Set(result.problems.map((problem) => problem.place.path));
    for (const name of [path, ...others]) {
        if (languageServer.value && documents.value.has(name)) continue;
        map.set(name, result.problems.filter((problem) => problem.place.path === name));
    }
    problems.value = map;
    if (show && !result.listing) {
        const first = result.problems.find((problem) => problem.severity === "error");
        if (first) {
            const { path: where, line, column } = first.place;
            void openFile(where, line, column);
            notify("error", `${where}:${line}: ${first.text}`);
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
    const result = await ask({ call: "assemble", path, texts: screenTexts() });
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
    busy.value = "Downloading";
    await saveAllKnown();
    const result = await ask({ call: "download", path, texts: screenTexts(), run });
    busy.value = "";
    if (!result) return null;
    keep(path, result, true);
    if (result.listing && !run) notify("information", `${result.listing.lines.length} instructions are in the module.`);
    return result;
}

/** Files that are on the disk already are saved before a download; new texts stay where they are. */
async function saveAllKnown(): Promise<void> {
    const fresh = [...documents.value.values()].some((document) => !document.stamp);
    if (!fresh) await saveAll();
}

/** Run from the start; downloads first when the source has changed since. */
export async function run(): Promise<void> {
    await download(true);
}

export async function upload(): Promise<void> {
    busy.value = "Reading the module";
    const text = await ask({ call: "upload" });
    busy.value = "";
    if (text === null) return;
    if (text.trim()) newFile(text, "uploaded");
    else notify("information", "The module's program memory is empty.");
}

/** The source differs from what the module holds. */
export const changedSinceDownload = (): boolean => {
    const now = assembled.value.get(target.value)?.listing;
    return !!loaded.value && !!now && now.identity !== loaded.value.identity;
};

// ------------------------------------------------------------------ checking while typing
let checkTimer = 0;
effect(() => {
    const document = documents.value.get(active.value);
    if (!document || !online.value) return;
    void document.text.value;
    clearTimeout(checkTimer);
    checkTimer = window.setTimeout(() => void check(document.path), 250);
});

async function check(path: string): Promise<void> {
    if (!online.value) return;
    const texts = { ...screenTexts(), [path]: documents.value.get(path)?.text.value ?? "" };
    const result = await ask({ call: "assemble", path, texts });
    if (result) keep(path, result, false);
}

// ------------------------------------------------------------------ language server
export const uriOf = (path: string): string =>
    "file://" + `${welcome.value!.folder}/${path}`.split("/").map(encodeURIComponent).join("/");
export function pathOf(uri: string): string {
    const path = decodeURIComponent(uri.replace(/^file:\/\//, ""));
    const folder = `${welcome.value!.folder}/`;
    return path.startsWith(folder) ? path.slice(folder.length) : path;
}

const SEVERITIES: Severity[] = ["error", "error", "warning", "information", "hint"];
interface PublishedDiagnostic {
    range: { start: { line: number; character: number }; end: { line: number; character: number } };
    severity?: number;
    code?: string | number;
    message: string;
}

function published(params: { uri: string; diagnostics: PublishedDiagnostic[] }): void {
    const path = pathOf(params.uri);
    const list: Problem[] = params.diagnostics.map(({ range, severity, code, message }) => ({
        place: {
            path, line: range.start.line + 1, column: range.start.character + 1,
            end_line: range.end.line + 1, end_column: range.end.character + 1,
        },
        severity: SEVERITIES[severity ?? 1]!, code: String(code ?? ""), text: message,
    }));
    problems.value = new Map(problems.value).set(path, list);
}

function connectLanguageServer(): void {
    const socket = new WebSocket(new URL("/lsp", location.href.replace(/^http/, "ws")));
    const handlers = new Set<(text: string) => void>();
    const transport: Transport = {
        send: (text) => socket.send(text),
        subscribe: (handler) => void handlers.add(handler),
        unsubscribe: (handler) => void handlers.delete(handler),
    };
    const client = new LSPClient({
        rootUri: uriOf("").replace(/\/$/, ""),
        extensions: [
            serverCompletion(), hoverTooltips({ hoverTime: 250 }), signatureHelp(), serverDiagnostics(),
            keymap.of([...jumpToDefinitionKeymap, ...findReferencesKeymap, ...formatKeymap, ...renameKeymap]),
        ],
        notificationHandlers: {
            "textDocument/publishDiagnostics": (_, params) => (published(params), false),
        },
        timeout: 10000,
    });
    socket.onmessage = ({ data }) => handlers.forEach((handler) => handler(String(data)));
    socket.onopen = () => {
        client.connect(transport);
        void client.initializing.then(() => (languageServer.value = client)).catch(() => {});
    };
    socket.onclose = () => {
        if (languageServer.value === client) languageServer.value = null;
        client.disconnect();
        reconnecting = false;
    };
}

let reconnecting = false;
effect(() => {
    if (!online.value || !can.value.language_server || languageServer.value || reconnecting) return;
    reconnecting = true;
    connectLanguageServer();
});

export const lspExtension = (path: string): Extension =>
    languageServer.value ? languageServer.value.plugin(uriOf(path), "tmcl") : [];

export { LSPPlugin };
