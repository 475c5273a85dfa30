// What keeps a control from being used: while it is disabled, its title says why.
import { computed } from "@preact/signals";
import { can, online, running } from "./app";
import { notReady } from "./authority";
import { busy } from "./build";
import { activeDocument, opened, target } from "./documents";
import { underWay } from "./modules";
import { past } from "./past";

export type Hindrance = string | false | null | undefined;

/** Attributes of a control that cannot be used while something hinders it. */
export const unless = (hindrance: Hindrance, title?: string) => ({
    disabled: !!hindrance,
    title: hindrance || title,
});

export const offline = computed(() => (online.value ? "" : "The IDE's server is not connected"));
export const connecting = computed(() => underWay.value && "Wait until the connection is made");
export const working = computed(
    () =>
        offline.value ||
        (opened.value ? busy.value && `${busy.value}: wait until it is done` : "The files are not open yet"),
);
export const inThePast = computed(() => past.value && "A past moment is shown: go back to the present first");
export const runs = computed(() => running.value && "The program runs: pause it first");
/** Of the program, and with it of motors; along the past nothing moves. */
export const unfree = computed(() => working.value || (past.value ? "" : notReady.value));
export const notVirtual = (ability: boolean): Hindrance => !ability && "Only a virtual module has this";
export const noBench = computed(() => offline.value || notVirtual(can.value.bench));
export const NO_FILE = "No file is in front";
export const noDocument = computed(() => !activeDocument.value && NO_FILE);
export const noProgram = computed(() => !target.value && "No program is in front");
export const unread = (value: unknown): Hindrance => value == null && "Not read from the module yet";
