// The opened folder.
import { useSignal } from "@preact/signals";
import { useLayoutEffect, useRef } from "preact/hooks";
import { ask, files, welcome } from "../logic/app";
import { active, documents, mainFile, newFile, openFile, openPage, problems, rename } from "../logic/documents";
import { remembered } from "../logic/settings";
import { IconButton, walk } from "../widgets/basics";
import { Icon } from "../widgets/icons";
import type { FileEntry } from "../wire";

/** Folders that are folded; a folder with many files begins so. */
const folded = remembered<Record<string, boolean>>("folded", {});
const MANY = 12;

const isFolded = (folder: string): boolean => folded.value[folder] ?? files.value.length > MANY;

function hidden(path: string): boolean {
    for (let at = path.indexOf("/"); at > 0; at = path.indexOf("/", at + 1))
        if (isFolded(path.slice(0, at))) return true;
    return false;
}

export function Files() {
    const renamed = useSignal("");
    const menu = useSignal<Place | null>(null);
    const list = files.value;
    const name = (welcome.value?.folder ?? "").split("/").filter(Boolean).pop() ?? "";
    return (
        <nav class="files" aria-label="Files">
            <header>
                <span title={welcome.value?.folder}>{name}</span>
                <IconButton icon="plus" title="New program (Alt+N)" label="New program" onClick={() => newFile()} />
            </header>
            <div class="tree" role="tree" aria-label="Files" onKeyDown={walk}>
                {list
                    .filter(entry => !hidden(entry.path))
                    .map(entry => (
                        <Entry key={entry.path} entry={entry} renamed={renamed} menu={menu} />
                    ))}
                {[...documents.value.values()]
                    .filter(document => !list.some(entry => entry.path === document.path))
                    .map(document => (
                        <button
                            key={document.path}
                            role="treeitem"
                            class={`entry new ${active.value === document.path ? "on" : ""}`}
                            onClick={() => openFile(document.path)}
                        >
                            <Icon name="file" size={14} />
                            <span>{document.path}</span>
                            <i class="dot" title="Not saved yet" />
                        </button>
                    ))}
                {!list.length && <p class="muted note">This folder is empty.</p>}
            </div>
            {menu.value && (
                <FileMenu
                    place={menu.value}
                    rename={path => (renamed.value = path)}
                    close={() => (menu.value = null)}
                />
            )}
            <div class="pages">
                <button class={active.value === ":parameters" ? "on" : ""} onClick={() => openPage("parameters")}>
                    <Icon name="table" size={14} /> Parameters
                </button>
                <button class={active.value === ":tools" ? "on" : ""} onClick={() => openPage("tools")}>
                    <Icon name="tools" size={14} /> Tools
                </button>
                <button class={active.value === ":listing" ? "on" : ""} onClick={() => openPage("listing")}>
                    <Icon name="list" size={14} /> Listing
                </button>
                <button class={active.value === ":connection" ? "on" : ""} onClick={() => openPage("connection")}>
                    <Icon name="plug" size={14} /> Connection
                </button>
            </div>
        </nav>
    );
}

interface Place {
    path: string;
    x: number;
    y: number;
}

const remove = (path: string) => confirm(`Delete ${path}?`) && void ask({ call: "delete_file", path });

/** What can be done with a file: a right click, a long press or the menu key on it. */
function FileMenu({
    place,
    rename: begin,
    close,
}: {
    place: Place;
    rename: (path: string) => void;
    close: () => void;
}) {
    const box = useRef<HTMLDivElement>(null);
    useLayoutEffect(() => box.current!.querySelector("button")!.focus(), [place]);
    const { path } = place;
    const main = mainFile.value === path;
    const rows: [string, () => unknown][] = [
        ["Rename", () => begin(path)],
        ["Delete…", () => remove(path)],
        [main ? "No main file" : "Make it the main file", () => (mainFile.value = main ? "" : path)],
    ];
    return (
        <div
            class="menu at"
            role="menu"
            aria-label={path}
            ref={box}
            style={{ left: `${place.x}px`, top: `${place.y}px` }}
            onKeyDown={event => (event.key === "Escape" ? close() : walk(event))}
            onFocusOut={event => event.currentTarget.contains(event.relatedTarget as Node | null) || close()}
        >
            {rows.map(([title, run]) => (
                <button
                    key={title}
                    role="menuitem"
                    onClick={() => {
                        close();
                        run();
                    }}
                >
                    {title}
                </button>
            ))}
        </div>
    );
}

function Entry({
    entry,
    renamed,
    menu,
}: {
    entry: FileEntry;
    renamed: { value: string };
    menu: { value: Place | null };
}) {
    const depth = entry.path.split("/").length - 1;
    const short = entry.path.split("/").pop()!;
    const document = documents.value.get(entry.path);
    const bad = problems.value.get(entry.path)?.some(problem => problem.severity === "error");
    const style = { paddingLeft: `${10 + depth * 12}px` };
    if (entry.folder)
        return (
            <button
                role="treeitem"
                aria-expanded={!isFolded(entry.path)}
                class="entry folder"
                style={style}
                onClick={() => (folded.value = { ...folded.value, [entry.path]: !isFolded(entry.path) })}
            >
                <Icon name={isFolded(entry.path) ? "right" : "down"} size={12} />
                <span>{short}</span>
            </button>
        );
    if (renamed.value === entry.path) return <Rename entry={entry} short={short} done={() => (renamed.value = "")} />;
    return (
        <button
            role="treeitem"
            class={`entry ${active.value === entry.path ? "on" : ""} ${bad ? "wrong" : ""}`}
            style={style}
            title={`${entry.path}${mainFile.value === entry.path ? " (main file)" : ""}`}
            onClick={() => openFile(entry.path)}
            onKeyDown={event => {
                if (event.key === "Delete") remove(entry.path);
            }}
            onContextMenu={event => {
                event.preventDefault();
                const { left, bottom } = event.currentTarget.getBoundingClientRect();
                menu.value = {
                    path: entry.path,
                    x: event.clientX || left + 20,
                    y: Math.min(event.clientY || bottom, window.innerHeight - 150),
                };
            }}
        >
            <Icon name="file" size={14} />
            <span>{short}</span>
            {mainFile.value === entry.path && <Icon name="star" size={12} />}
            {document?.dirty.value && <i class="dot" title="Not saved" />}
        </button>
    );
}

/** The field keeps what is typed whatever happens to the folder meanwhile. */
function Rename({ entry, short, done }: { entry: FileEntry; short: string; done: () => void }) {
    const field = useRef<HTMLInputElement>(null);
    useLayoutEffect(() => {
        field.current!.value = short;
        field.current!.focus();
    }, []);
    return (
        <input
            class="rename"
            aria-label={`New name of ${short}`}
            ref={field}
            onBlur={done}
            onKeyDown={event => {
                if (event.key === "Escape") done();
                if (event.key !== "Enter") return;
                const name = event.currentTarget.value.trim();
                const to = entry.path.slice(0, entry.path.length - short.length) + name;
                done();
                if (name && to !== entry.path) void rename(entry.path, to);
            }}
        />
    );
}
