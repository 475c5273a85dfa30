// The text on screen beside its file, or beside the program in the module.
import { signal } from "@preact/signals";
import type { Comparison } from "../wire";
import { ask, notify } from "./app";
import { busy } from "./build";
import { openPage, screenTexts, target } from "./documents";
import { options } from "./options";

export const comparison = signal<Comparison | null>(null);

export async function compare(against: "disk" | "module"): Promise<void> {
    const path = target.value;
    if (!path) return notify("information", "Open a program first.");
    busy.value = "Comparing";
    const found = await ask({ call: "compare", path, against, texts: screenTexts(), options: options.value });
    busy.value = "";
    if (!found) return;
    comparison.value = found;
    openPage("compare");
}
