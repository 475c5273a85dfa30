// The map of the program in front: routines, stack, user variables, labels.
import { computed, effect, signal } from "@preact/signals";
import type { FlowMap } from "../wire";
import { connection, online } from "./app";
import { assembled } from "./build";
import { screenTexts, target } from "./documents";
import { options } from "./options";

/** Null while the program has errors, there is none, or it was not read yet. */
export const flowMap = signal<FlowMap | null>(null);
/** The path of the program that `flowMap` is about. */
const read = signal("");
/** Why there is no map. */
export const nothing = computed(() => {
    if (!target.value) return "Open a program to see its labels.";
    return read.value === target.value
        ? "The program has errors: see the problems below."
        : "The program is being read.";
});
/** Some open panel shows it. */
export const flowWanted = signal(0);
const PAUSE_MS = 300;

let timer = 0;
effect(() => {
    clearTimeout(timer);
    const path = target.value;
    void assembled.value.get(path);
    if (!flowWanted.value || !online.value) return;
    timer = window.setTimeout(() => void look(path), read.peek() === path ? PAUSE_MS : 0);
});

async function look(path: string): Promise<void> {
    const call = { call: "read_map", path, texts: screenTexts(), options: options.peek() } as const;
    const found = path ? await connection.call(call).catch(() => null) : null;
    if (path !== target.peek()) return;
    flowMap.value = found;
    read.value = path;
}
