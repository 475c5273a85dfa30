// Which panels are shown and how large; remembered by the browser.
import { signal, type Signal } from "@preact/signals";
import { remembered } from "./settings";

export type RightPanel = "axes" | "machine" | "bench" | "program" | "outline" | "";
export type BottomPanel = "plot" | "direct" | "log" | "problems" | "";

export const theme = remembered<"dark" | "light" | "">("theme", "");
const fingers = matchMedia("(pointer: coarse)").matches;
export const layout = remembered("layout", {
    files: true,
    filesWidth: 188,
    rightWidth: fingers ? 476 : 404,
    bottomHeight: fingers ? 320 : 280,
});
export const right = remembered<RightPanel>("right", "axes");
/** With room enough the axes stay, and another panel stands beside them. */
const wide = matchMedia("(min-width: 1600px)");
export const roomy = signal(wide.matches);
wide.addEventListener("change", () => (roomy.value = wide.matches));
export const second = remembered<"machine" | "bench" | "program" | "outline">("second", "bench");
export const bottom = remembered<BottomPanel>("bottom", "plot");
/** Below a page that is no file, which needs the room, the lower panel is closed unless asked for. */
export const bottomOfPages = remembered<BottomPanel>("bottom-of-pages", "");
export const onPage = signal(false);
export const lowerPanel = (): Signal<BottomPanel> => (onPage.value ? bottomOfPages : bottom);
/** On a narrow page the files lie over it. */
export const drawer = signal(false);
export const bottomTall = signal(false);
/** Text in the palette; null while it is closed. */
export const palette = signal<string | null>(null);

export function showRight(panel: RightPanel): void {
    if (roomy.value && panel !== "axes" && panel !== "") second.value = panel;
    else right.value = panel;
    if (roomy.value && !right.value) right.value = "axes";
}
export const showBottom = (panel: BottomPanel): void => void (lowerPanel().value = panel);
