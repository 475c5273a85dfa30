// The map of the program in front: routines, stack, user variables, labels.
import { effect, signal } from "@preact/signals";
import type { FlowMap } from "../wire";
import { connection, online } from "./app";
import { assembled } from "./build";
import { screenTexts, target } from "./documents";
import { options } from "./options";

/** Null while the program has errors, or there is none. */
export const flowMap = signal<FlowMap | null>(null);
/** Some open panel shows it. */
export const flowWanted = signal(0);
const PAUSE_MS = 300;

let timer = 0;
effect(() => {
    clearTimeout(timer);
    const path = target.value;
    void assembled.value.get(path);
    if (!flowWanted.value || !online.value) return;
    timer = window.setTimeout(() => void read(path), PAUSE_MS);
});

async function read(path: string): Promise<void> {
    const call = { call: "read_map", path, texts: screenTexts(), options: options.peek() } as const;
    const found = path ? await connection.call(call).catch(() => null) : null;
    if (path === target.peek()) flowMap.value = found;
}
