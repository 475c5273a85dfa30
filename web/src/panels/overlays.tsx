// Palette, overview of keys, notices, and what is said when the server is away.
import { useSignal } from "@preact/signals";
import { useLayoutEffect, useRef } from "preact/hooks";
import { ACTIONS, overview, perform } from "../logic/actions";
import {
    ask,
    connection,
    dismiss,
    files,
    link,
    notices,
    plugged,
    powered,
    progress,
    told,
    welcome,
} from "../logic/app";
import { assembled } from "../logic/build";
import { openFile, openPage, PAGES, target, type PageName } from "../logic/documents";
import { question } from "../logic/confirm";
import { palette } from "../logic/layout";
import { score } from "../logic/text";
import { SECTIONS, TOOLS, section, tool, type SectionName, type ToolName } from "../logic/views";
import { IconButton, Modal } from "../widgets/basics";
import { Icon } from "../widgets/icons";

interface Row {
    title: string;
    detail: string;
    run: () => unknown;
    weight: number;
}

/** Labels of the program in front, each with its line. */
function labels(): Row[] {
    const listing = assembled.value.get(target.value)?.listing;
    if (!listing) return [];
    return listing.symbols
        .filter(symbol => symbol.kind === "label")
        .flatMap(symbol => {
            const line = listing.lines[Number(symbol.value)];
            return line?.line
                ? [
                      {
                          title: symbol.name,
                          detail: `label, line ${line.line}`,
                          run: () => openFile(line.path, line.line),
                          weight: 0,
                      },
                  ]
                : [];
        });
}

export function Palette() {
    const chosen = useSignal(0);
    const field = useRef<HTMLInputElement>(null);
    const open = palette.value !== null;
    useLayoutEffect(() => {
        if (open) field.current?.focus();
        chosen.value = 0;
    }, [open]);
    if (palette.value === null) return null;
    const wish = palette.value.trim().toLowerCase();
    const close = () => (palette.value = null);
    const rows: Row[] = [
        ...files.value
            .filter(file => !file.folder)
            .map(file => ({ title: file.path, detail: "file", run: () => openFile(file.path), weight: 1 })),
        ...ACTIONS.filter(row => row.id !== "open" && !row.hindrance?.()).map(row => ({
            title: row.title,
            detail: [row.on?.() && "on", row.keys?.[0] ?? row.group].filter(Boolean).join(" \u00b7 "),
            run: () => perform(row.id),
            weight: 0,
        })),
        ...Object.entries(PAGES)
            .filter(([kind]) => kind !== "guide")
            .map(([kind, title]) => ({
                title: `Open ${title}`,
                detail: "page",
                run: () => openPage(kind as PageName),
                weight: 0,
            })),
        ...Object.entries(TOOLS).map(([id, title]) => ({
            title,
            detail: "tool",
            run: () => {
                openPage("tools");
                tool.value = id as ToolName;
            },
            weight: 0,
        })),
        ...Object.entries(SECTIONS).map(([id, title]) => ({
            title: `Parameters: ${title}`,
            detail: "page",
            run: () => {
                openPage("parameters");
                section.value = id as SectionName;
            },
            weight: 0,
        })),
        ...labels(),
    ];
    const found = rows
        .map(row => ({ row, rank: score(row.title, wish) + row.weight }))
        .filter(({ rank }) => rank >= 1)
        .filter(({ row }) => score(row.title, wish) > 0)
        .sort((a, b) => b.rank - a.rank)
        .slice(0, 14);
    const go = (row?: Row) => {
        close();
        if (row) void row.run();
    };
    return (
        <Modal class="palette" label="Open a file or run a command" onClose={close}>
            <input
                ref={field}
                placeholder="File or command"
                aria-label="File or command"
                value={palette.value}
                onInput={event => {
                    palette.value = event.currentTarget.value;
                    chosen.value = 0;
                }}
                onKeyDown={event => {
                    if (event.key === "Enter") go(found[chosen.value]?.row);
                    else if (event.key === "ArrowDown") chosen.value = Math.min(found.length - 1, chosen.value + 1);
                    else if (event.key === "ArrowUp") chosen.value = Math.max(0, chosen.value - 1);
                    else return;
                    event.preventDefault();
                    event.stopPropagation();
                }}
            />
            <div role="listbox" aria-label="Found">
                {found.map(({ row }, n) => (
                    <button
                        key={row.title + row.detail}
                        role="option"
                        aria-selected={n === chosen.value}
                        class={n === chosen.value ? "on" : ""}
                        onPointerMove={() => (chosen.value = n)}
                        onClick={() => go(row)}
                    >
                        <span>{row.title}</span>
                        <kbd>{row.detail}</kbd>
                    </button>
                ))}
                {!found.length && <p class="muted note">Nothing of that name.</p>}
            </div>
        </Modal>
    );
}

export function Overview() {
    if (!overview.value) return null;
    const groups = ["Program", "Module", "File", "View"] as const;
    return (
        <Modal class="overview" label="Keyboard shortcuts" onClose={() => (overview.value = false)}>
            <header>
                <h2>Keyboard shortcuts</h2>
                <IconButton icon="close" label="Close" onClick={() => (overview.value = false)} />
            </header>
            <div class="groups">
                {groups.map(group => (
                    <section key={group}>
                        <h3>{group}</h3>
                        <dl>
                            {ACTIONS.filter(row => row.group === group && row.keys).map(row => (
                                <div key={row.id}>
                                    <dt>{row.title}</dt>
                                    <dd>
                                        {row.keys!.map(keys => (
                                            <kbd key={keys}>{keys}</kbd>
                                        ))}
                                    </dd>
                                </div>
                            ))}
                        </dl>
                    </section>
                ))}
                <section>
                    <h3>Editor</h3>
                    <dl>
                        {[
                            ["Complete", "Ctrl+Space"],
                            ["Go to definition", "F12"],
                            ["References", "Shift+F12"],
                            ["Format", "Shift+Alt+F"],
                            ["Rename symbol", "Shift+F6"],
                            ["Comment lines", "Ctrl+/"],
                            ["Delete line", "Ctrl+Y"],
                            ["Undo", "Ctrl+Z"],
                            ["Redo", "Ctrl+Shift+Z"],
                            ["Next problem", "Ctrl+F8"],
                            ["Leave the editor", "Esc, then Tab"],
                        ].map(([title, keys]) => (
                            <div key={title}>
                                <dt>{title}</dt>
                                <dd>
                                    <kbd>{keys}</kbd>
                                </dd>
                            </div>
                        ))}
                    </dl>
                </section>
                <section>
                    <h3>Axes</h3>
                    <dl>
                        <div>
                            <dt>Jog while held</dt>
                            <dd>
                                <kbd>Space</kbd> on an arrow button
                            </dd>
                        </div>
                        <div>
                            <dt>Take a number</dt>
                            <dd>
                                <kbd>Enter</kbd>
                            </dd>
                        </div>
                        <div>
                            <dt>Give it back</dt>
                            <dd>
                                <kbd>Esc</kbd>
                            </dd>
                        </div>
                    </dl>
                </section>
            </div>
        </Modal>
    );
}

/** A question of `choose`; closing it is no answer. */
export function Confirmation() {
    const asked = question.value;
    if (!asked) return null;
    return (
        <Modal class="confirmation" label={asked.title} onClose={() => asked.settle(null)}>
            <h2>{asked.title}</h2>
            <p>{asked.text}</p>
            <div class="row">
                <span class="gap" />
                <button onClick={() => asked.settle(null)}>{asked.answers.length ? "Cancel" : "Close"}</button>
                {asked.answers.map(answer => (
                    <button key={answer.id} class={answer.tone} onClick={() => asked.settle(answer.id)}>
                        {answer.title}
                    </button>
                ))}
            </div>
        </Modal>
    );
}

export function Notices() {
    return (
        <div class="notices" role="status" aria-live="polite">
            {notices.value.map(notice => (
                <div key={notice.id} class={`notice ${notice.severity}`}>
                    <Icon name={notice.severity === "information" ? "info" : "alert"} />
                    <span>{notice.text}</span>
                    {notice.action && (
                        <button
                            onClick={() => {
                                notice.action!.run();
                                dismiss(notice.id);
                            }}
                        >
                            {notice.action.title}
                        </button>
                    )}
                    <IconButton icon="close" size={12} label="Dismiss" onClick={() => dismiss(notice.id)} />
                </div>
            ))}
            {progress.value && (
                <div class="notice">
                    <span>
                        {progress.value.title} {progress.value.done} / {progress.value.total}
                    </span>
                    <span class="bar">
                        <span style={{ width: `${(progress.value.done / progress.value.total) * 100}%` }} />
                    </span>
                </div>
            )}
        </div>
    );
}

/** A strip across the page while something is missing. */
export function Banner() {
    const state = connection.state.value;
    if (state === "refused")
        return (
            <div class="banner bad" role="alert">
                <Icon name="alert" /> The IDE's server was restarted and this window is no longer valid. Open the
                address that it printed; your texts are kept in this browser.
            </div>
        );
    if (state === "lost" || (state === "connecting" && welcome.value))
        return (
            <div class="banner bad" role="alert">
                <Icon name="plug" /> The IDE's server does not answer. What you type is kept; the page comes back by
                itself.
            </div>
        );
    if (!link.value.up)
        return (
            <div class="banner bad" role="alert">
                <Icon name="plug" /> <span>{link.value.text}</span>{" "}
                {link.value.ascii && (
                    <button onClick={() => ask({ call: "send_ascii", line: "BIN" })}>Back to binary</button>
                )}
            </div>
        );
    if (!welcome.value?.ability.bench || !told.value) return null;
    const repair = (what: "power" | "line", title: string) => (
        <button onClick={() => ask({ call: "set_bench", what, index: 0, value: 1 })}>{title}</button>
    );
    if (!powered.value)
        return (
            <div class="banner" role="status">
                <Icon name="power" /> The module has no power. {repair("power", "Switch it on")}
            </div>
        );
    if (!plugged.value)
        return (
            <div class="banner" role="status">
                <Icon name="plug" /> The line is unplugged: the module keeps running and receives nothing.{" "}
                {repair("line", "Plug it in")}
            </div>
        );
    return null;
}
