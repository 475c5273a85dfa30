// Texts that were not saved, kept in the browser's store. Each window keeps its own; what a window leaves behind
// that is no more, whatever ended it, the next one to open the file takes over.
import { welcome } from "./app";
import { names, read, write } from "./settings";

export interface Draft {
    text: string;
    /** Of the file that the text began from; empty for a new one. */
    stamp: string;
    /** When it was kept [ms]. */
    at: number;
}

/** The same over a reload, another one for each window. */
const WINDOW = sessionStorage.getItem("tmcm34x.window") ?? crypto.getRandomValues(new Uint32Array(2)).join("-");
sessionStorage.setItem("tmcm34x.window", WINDOW);
const LOCK = "tmcm34x.window.";
/** Held as long as this window lives. */
void navigator.locks?.request(LOCK + WINDOW, () => new Promise(() => {}));

const prefix = (): string => `draft.${welcome.peek()?.folder ?? ""}\n`;
const name = (path: string, window = WINDOW): string => `${prefix()}${path}\n${window}`;

function stored(): { name: string; path: string; window: string }[] {
    const start = prefix();
    return names(start).map(found => {
        const [path, window] = found.slice(start.length).split("\n") as [string, string];
        return { name: found, path, window };
    });
}

/** Windows that are open now, without this one; unknown where the page did not come from this machine. */
async function others(): Promise<Set<string>> {
    const held = (await navigator.locks?.query())?.held ?? [];
    const windows = held.map(lock => lock.name ?? "").filter(lock => lock.startsWith(LOCK));
    return new Set(windows.map(lock => lock.slice(LOCK.length)).filter(window => window !== WINDOW));
}

/** Keep a text; false when the store is full. */
export const keepDraft = (path: string, text: string, stamp: string): boolean =>
    write(name(path), { text, stamp, at: Date.now() } satisfies Draft);

/** This window's text of `path` is saved, or given up. */
export const dropDraft = (path: string): void => void write(name(path), null);

/** Whether any window has kept a text under this path. */
export const isDraft = (path: string): boolean => stored().some(draft => draft.path === path);

/** This window's draft, or the newest of a window that is no more, which becomes this one's. */
export async function takeDraft(path: string): Promise<Draft | null> {
    const own = read<Draft>(name(path));
    if (own) return own;
    const living = await others();
    const left = stored().filter(draft => draft.path === path && !living.has(draft.window));
    const drafts = left.map(found => ({ ...found, draft: read<Draft>(found.name)! }));
    const newest = drafts.sort((a, b) => b.draft.at - a.draft.at)[0];
    if (!newest) return null;
    write(newest.name, null);
    write(name(path), newest.draft);
    return newest.draft;
}

/** Paths with drafts that this window may take. */
export async function draftPaths(): Promise<string[]> {
    const living = await others();
    return [
        ...new Set(
            stored()
                .filter(draft => !living.has(draft.window))
                .map(draft => draft.path),
        ),
    ];
}
