// The language server of the editor: connection, squiggles with fixes, hints beside numbers, jumps between files.
import {
    LSPClient,
    LSPPlugin,
    Workspace,
    findReferencesKeymap,
    formatKeymap,
    hoverTooltips,
    jumpToDefinitionKeymap,
    renameKeymap,
    serverCompletion,
    signatureHelp,
    type Transport,
    type WorkspaceFile,
} from "@codemirror/lsp-client";
import { setDiagnostics, type Diagnostic } from "@codemirror/lint";
import { StateEffect, StateField, type Extension, type Text } from "@codemirror/state";
import {
    Decoration,
    EditorView,
    ViewPlugin,
    WidgetType,
    keymap,
    type DecorationSet,
    type ViewUpdate,
} from "@codemirror/view";
import { effect, signal } from "@preact/signals";
import type { Problem, Severity } from "../wire";
import { can, online, welcome } from "../logic/app";
import { openFile, problems } from "../logic/documents";
import { options } from "../logic/options";
import { remembered } from "../logic/settings";

/** Set while the language server is connected: squiggles come from it then. */
export const languageServer = signal<LSPClient | null>(null);
export const showHints = remembered("hints", true);

const SYNC_MS = 30;
const HINTS_MS = 150;

interface Position {
    line: number;
    character: number;
}
interface Range {
    start: Position;
    end: Position;
}
interface Published {
    range: Range;
    severity?: number;
    code?: string | number;
    message: string;
}
interface TextEdit {
    range: Range;
    newText: string;
}
interface CodeAction {
    title: string;
    edit?: { changes?: Record<string, TextEdit[]> };
}
interface InlayHint {
    position: Position;
    label: string | { value: string }[];
}

export const uriOf = (path: string): string =>
    `file://${`${welcome.value!.folder}/${path}`.split("/").map(encodeURIComponent).join("/")}`;

export function pathOf(uri: string): string {
    const path = decodeURIComponent(uri.replace(/^file:\/\//, ""));
    const folder = `${welcome.value!.folder}/`;
    return path.startsWith(folder) ? path.slice(folder.length) : path;
}

// ------------------------------------------------------------------ files
interface OpenFile extends WorkspaceFile {
    view: EditorView;
}

/** The files that have a view; a jump to another one opens it. */
class Files extends Workspace {
    override files: OpenFile[] = [];
    private versions = new Map<string, number>();

    private next(uri: string): number {
        const version = (this.versions.get(uri) ?? -1) + 1;
        this.versions.set(uri, version);
        return version;
    }

    override syncFiles() {
        return this.files.flatMap(file => {
            const plugin = LSPPlugin.get(file.view);
            if (!plugin || plugin.unsyncedChanges.empty) return [];
            const update = { changes: plugin.unsyncedChanges, file, prevDoc: file.doc as Text };
            file.doc = file.view.state.doc;
            file.version = this.next(file.uri);
            plugin.clear();
            return [update];
        });
    }

    override openFile(uri: string, languageId: string, view: EditorView): void {
        const file: OpenFile = {
            uri,
            languageId,
            version: this.next(uri),
            doc: view.state.doc,
            view,
            getView: () => view,
        };
        this.files = [...this.files.filter(other => other.uri !== uri), file];
        this.client.didOpen(file);
    }

    override closeFile(uri: string, view: EditorView): void {
        if (!this.files.some(file => file.uri === uri && file.view === view)) return;
        this.files = this.files.filter(file => file.uri !== uri);
        this.client.didClose(uri);
    }

    override async displayFile(uri: string): Promise<EditorView | null> {
        await openFile(pathOf(uri));
        for (let tries = 0; tries < 40; tries++) {
            const found = this.getFile(uri)?.getView();
            if (found) return found;
            await new Promise(done => setTimeout(done, 25));
        }
        return null;
    }
}

// ------------------------------------------------------------------ squiggles
const SEVERITIES: Severity[] = ["error", "error", "warning", "information", "hint"];

function remember(path: string, diagnostics: Published[]): void {
    const list: Problem[] = diagnostics.map(({ range, severity, code, message }) => ({
        place: {
            path,
            line: range.start.line + 1,
            column: range.start.character + 1,
            end_line: range.end.line + 1,
            end_column: range.end.character + 1,
        },
        severity: SEVERITIES[severity ?? 1]!,
        code: String(code ?? ""),
        text: message,
    }));
    problems.value = new Map(problems.value).set(path, list);
}

/** What stands in the bubble over a squiggle: the message, and buttons for the server's fixes. */
function bubble(view: EditorView, published: Published): HTMLElement {
    const box = document.createElement("div");
    box.className = "diagnostic";
    const text = box.appendChild(document.createElement("div"));
    text.textContent = published.message;
    const code = text.appendChild(document.createElement("span"));
    code.className = "diagnostic-code";
    code.textContent = String(published.code ?? "");
    const plugin = LSPPlugin.get(view);
    if (!plugin) return box;
    plugin.client.sync();
    const ask = {
        textDocument: { uri: plugin.uri },
        range: published.range,
        context: { diagnostics: [published], only: ["quickfix"] },
    };
    void plugin.client
        .request<typeof ask, CodeAction[] | null>("textDocument/codeAction", ask)
        .then(actions => {
            for (const action of actions ?? []) {
                const button = box.appendChild(document.createElement("button"));
                button.textContent = action.title;
                button.onclick = () => apply(view, action);
            }
        })
        .catch(() => {});
    return box;
}

function apply(view: EditorView, action: CodeAction): void {
    const plugin = LSPPlugin.get(view);
    const edits = plugin && action.edit?.changes?.[plugin.uri];
    if (!plugin || !edits) return;
    view.dispatch({
        changes: edits.map(edit => ({
            from: plugin.fromPosition(edit.range.start),
            to: plugin.fromPosition(edit.range.end),
            insert: edit.newText,
        })),
        userEvent: "input.fix",
    });
    view.focus();
}

function publish(client: LSPClient, params: { uri: string; version?: number; diagnostics: Published[] }): boolean {
    remember(pathOf(params.uri), params.diagnostics);
    const file = client.workspace.getFile(params.uri);
    if (!file || (params.version != null && params.version !== file.version)) return true;
    const view = file.getView();
    const plugin = view && LSPPlugin.get(view);
    if (!view || !plugin) return true;
    const place = (position: Position) => {
        const { doc } = file;
        const line = doc.line(Math.min(position.line + 1, doc.lines));
        return plugin.unsyncedChanges.mapPos(Math.min(line.from + position.character, line.to));
    };
    const diagnostics = params.diagnostics.map(
        (item): Diagnostic => ({
            from: place(item.range.start),
            to: Math.max(place(item.range.start), place(item.range.end)),
            severity: (["error", "warning", "info", "hint"] as const)[(item.severity ?? 1) - 1] ?? "error",
            message: item.message,
            source: String(item.code ?? ""),
            renderMessage: inside => bubble(inside, item),
        }),
    );
    view.dispatch(setDiagnostics(view.state, diagnostics));
    return true;
}

/** Sends changes soon: the answer to a keystroke should be there before the next one. */
const promptly = ViewPlugin.fromClass(
    class {
        private timer = 0;
        update(update: ViewUpdate): void {
            if (!update.docChanged) return;
            clearTimeout(this.timer);
            this.timer = window.setTimeout(() => LSPPlugin.get(update.view)?.client.sync(), SYNC_MS);
        }
        destroy(): void {
            clearTimeout(this.timer);
        }
    },
);

// ------------------------------------------------------------------ hints
const putHints = StateEffect.define<DecorationSet>();

const hintField = StateField.define<DecorationSet>({
    create: () => Decoration.none,
    update(set, transaction) {
        set = set.map(transaction.changes);
        for (const effect of transaction.effects) if (effect.is(putHints)) set = effect.value;
        return set;
    },
    provide: field => EditorView.decorations.from(field),
});

class Hint extends WidgetType {
    constructor(readonly text: string) {
        super();
    }
    override eq(other: Hint): boolean {
        return other.text === this.text;
    }
    override toDOM(): HTMLElement {
        const span = document.createElement("span");
        span.className = "inlay";
        span.textContent = this.text;
        return span;
    }
}

const hints = ViewPlugin.fromClass(
    class {
        private timer = 0;
        constructor(private readonly view: EditorView) {
            this.soon();
        }
        update(update: ViewUpdate): void {
            if (update.docChanged || update.viewportChanged) this.soon();
        }
        private soon(): void {
            clearTimeout(this.timer);
            this.timer = window.setTimeout(() => void this.ask(), HINTS_MS);
        }
        private async ask(): Promise<void> {
            const { view } = this;
            const plugin = LSPPlugin.get(view);
            if (!plugin || !view.dom.isConnected) return;
            if (!showHints.peek()) return void view.dispatch({ effects: putHints.of(Decoration.none) });
            plugin.client.sync();
            const { from, to } = view.viewport;
            const { doc } = view.state;
            const params = {
                textDocument: { uri: plugin.uri },
                range: { start: plugin.toPosition(from), end: plugin.toPosition(to) },
            };
            const list = await plugin.client
                .request<typeof params, InlayHint[] | null>("textDocument/inlayHint", params)
                .catch(() => null);
            if (!list || view.state.doc !== doc) return;
            const marks = list.map(({ position, label }) => {
                const text = typeof label === "string" ? label : label.map(part => part.value).join("");
                return Decoration.widget({ widget: new Hint(text), side: 1 }).range(plugin.fromPosition(position));
            });
            view.dispatch({ effects: putHints.of(Decoration.set(marks, true)) });
        }
        destroy(): void {
            clearTimeout(this.timer);
        }
    },
);

// ------------------------------------------------------------------ connection
function connect(): void {
    const socket = new WebSocket(new URL("/lsp", location.href.replace(/^http/, "ws")));
    const handlers = new Set<(text: string) => void>();
    const transport: Transport = {
        send: text => {
            if (socket.readyState === WebSocket.OPEN) socket.send(text);
        },
        subscribe: handler => void handlers.add(handler),
        unsubscribe: handler => void handlers.delete(handler),
    };
    const client = new LSPClient({
        rootUri: uriOf("").replace(/\/$/, ""),
        // The gutter shows addresses already.
        initializationOptions: { hints: ["parameter", "value"] },
        workspace: owner => new Files(owner),
        extensions: [
            serverCompletion(),
            hoverTooltips({ hoverTime: 250 }),
            signatureHelp(),
            promptly,
            hintField,
            hints,
            keymap.of([...jumpToDefinitionKeymap, ...findReferencesKeymap, ...formatKeymap, ...renameKeys]),
            {
                clientCapabilities: {
                    textDocument: {
                        publishDiagnostics: { versionSupport: true },
                        inlayHint: {},
                        codeAction: { codeActionLiteralSupport: { codeActionKind: { valueSet: ["quickfix"] } } },
                    },
                },
            },
        ],
        notificationHandlers: { "textDocument/publishDiagnostics": publish },
        timeout: 10000,
    });
    socket.onmessage = ({ data }) => {
        for (const handler of handlers) handler(String(data));
    };
    socket.onopen = () => {
        client.connect(transport);
        void client.initializing.then(() => (languageServer.value = client)).catch(() => {});
    };
    socket.onclose = () => {
        if (languageServer.value === client) languageServer.value = null;
        client.disconnect();
        setTimeout(() => (connecting.value = false), 1000);
    };
}

/** F2 pauses the program: a symbol is renamed with Shift+F6. */
const renameKeys = renameKeymap.map(binding => ({ ...binding, key: "Shift-F6" }));
const connecting = signal(false);
effect(() => {
    if (!online.value || !can.value.language_server || connecting.value) return;
    connecting.value = true;
    connect();
});

/** What the program is judged for: the module at hand, or what the assembler's options say. */
effect(() => {
    const model = options.value.model || welcome.value?.model.number;
    languageServer.value?.notification("workspace/didChangeConfiguration", { settings: { tmcl: { model } } });
});

export const lspExtension = (path: string): Extension =>
    languageServer.value ? languageServer.value.plugin(uriOf(path), "tmcl") : [];
