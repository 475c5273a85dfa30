// What the page remembers in the browser: layout, theme, drafts of texts that are not yet saved.
import { effect, signal, type Signal } from "@preact/signals";

const PREFIX = "tmcm34x.";

/** A signal whose value outlives the page. */
export function remembered<T>(name: string, initial: T): Signal<T> {
    const value = signal<T>(read(name) ?? initial);
    effect(() => void write(name, value.value));
    return value;
}

export function read<T>(name: string): T | null {
    try {
        const text = localStorage.getItem(PREFIX + name);
        return text === null ? null : (JSON.parse(text) as T);
    } catch {
        return null;
    }
}

/** False when the browser's store is full or forbidden. */
export function write(name: string, value: unknown): boolean {
    try {
        if (value === null || value === undefined) localStorage.removeItem(PREFIX + name);
        else localStorage.setItem(PREFIX + name, JSON.stringify(value));
        return true;
    } catch {
        return false;
    }
}

/** Names in the store that begin with `start`. */
export function names(start: string): string[] {
    const found: string[] = [];
    for (let n = 0; n < localStorage.length; n++) {
        const key = localStorage.key(n)!;
        if (key.startsWith(PREFIX + start)) found.push(key.slice(PREFIX.length));
    }
    return found;
}
