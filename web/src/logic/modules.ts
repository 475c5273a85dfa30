// Which module the IDE is connected to: ports, what answered on them, and going from one module to another.
import { computed, signal } from "@preact/signals";
import type { Examples, Ports, ScanFound, ScanProgress, UseVirtual } from "../wire";
import { ask, connection, link, notify, onServerEvent, welcome } from "./app";
import { choose } from "./confirm";
import { RefusedError } from "./connection";
import { remembered } from "./settings";

export const ports = signal<Ports | null>(null);
/** Scans look at all addresses, not only at the lowest. */
export const far = remembered("scan-far", false);
export const found = signal<ScanFound[]>([]);
/** Ports that could not be looked at, and why. */
export const unseen = signal<string[]>([]);
export const scanning = signal<Omit<ScanProgress, "event"> | null>(null);
/** What the last scan was of and whether it came to its end; null before the first. */
export const scanned = signal<{ ports: string[]; complete: boolean } | null>(null);
/** Lines that were connected to, the last one first. */
export const recent = remembered<string[]>("recent-lines", []);
const RECENT = 8;
/** What is being connected to. */
export const underWay = signal("");
/** Why the last attempt failed; `silent`: the line is there, and the module may come. */
export const trouble = signal<{ url: string; text: string; silent: boolean } | null>(null);
export const examples = signal<Examples | null>(null);

export const isVirtual = computed(() => welcome.value?.source === "virtual");
/** The module for people: bench, or port, rate and address. */
export const place = computed(() =>
    isVirtual.value ? `virtual \u00b7 ${welcome.value!.module}` : link.value.place || welcome.value?.module || "",
);

export const listPorts = async (): Promise<unknown> => (ports.value = await ask({ call: "list_ports" }));
export async function listExamples(): Promise<void> {
    examples.value ??= await ask({ call: "list_examples" });
}

// ------------------------------------------------------------------ scanning
export async function scan(lines: string[], far: boolean): Promise<void> {
    found.value = found.value.filter(row => !lines.some(line => row.url.startsWith(line.split("?")[0]!)));
    unseen.value = [];
    scanned.value = { ports: lines, complete: false };
    scanning.value = { done: 0, total: 0, place: "" };
    try {
        await connection.call({ call: "scan", ports: lines, far });
    } catch (error) {
        if (!(error instanceof RefusedError)) throw error;
        scanning.value = scanned.value = null;
        notify("error", error.message, undefined, "scan");
    }
}
export const stopScan = (): Promise<unknown> => ask({ call: "stop_scan" });

onServerEvent(event => {
    if (event.event === "scan_progress") scanning.value = event;
    if (event.event === "scan_found") found.value = [...found.value, event];
    if (event.event === "scan_failed") unseen.value = [...unseen.value, event.text];
    if (event.event === "scan_ended") {
        scanning.value = null;
        scanned.value = { ports: scanned.value?.ports ?? [], complete: event.complete };
    }
});

// ------------------------------------------------------------------ going to another module
/** Do a call that may leave the module; whether it was done. */
async function go(name: string, work: () => Promise<unknown>): Promise<RefusedError | null> {
    underWay.value = name;
    try {
        await work();
        return null;
    } catch (error) {
        if (!(error instanceof RefusedError)) throw error;
        return error;
    } finally {
        underWay.value = "";
    }
}

export async function connectTo(url: string, anyway = false): Promise<boolean> {
    trouble.value = null;
    const refused = await go(url, () => connection.call({ call: "connect", url, anyway }));
    if (refused) trouble.value = { url, text: refused.message, silent: refused.code === "silent" };
    else recent.value = [url, ...recent.value.filter(other => other !== url)].slice(0, RECENT);
    return !refused;
}

/** Whether a real module may be left for a virtual one. */
async function mayLeave(): Promise<boolean> {
    if (isVirtual.value) return true;
    const text = `The IDE leaves ${place.value}. What was started from here is stopped first.`;
    return (await choose("Leave the module?", text, [{ id: "leave", title: "Leave it", tone: "primary" }])) === "leave";
}

export async function useVirtual(call: Omit<UseVirtual, "call">): Promise<boolean> {
    if (!(await mayLeave())) return false;
    trouble.value = null;
    const refused = await go("virtual", () => connection.call({ call: "use_virtual", ...call }));
    if (refused) notify("error", refused.message, undefined, "bench");
    return !refused;
}
