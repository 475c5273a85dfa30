// Which panels are shown and how large; remembered by the browser.
import { signal } from "@preact/signals";
import { remembered } from "./settings";

export type RightPanel = "axes" | "bench" | "program" | "";
export type BottomPanel = "plot" | "direct" | "log" | "problems" | "";

export const theme = remembered<"dark" | "light" | "">("theme", "");
export const layout = remembered("layout", { files: true, filesWidth: 168, rightWidth: 404, bottomHeight: 236 });
export const right = remembered<RightPanel>("right", "axes");
export const bottom = remembered<BottomPanel>("bottom", "plot");
export const bottomTall = signal(false);
/** Text in the palette; null while it is closed. */
export const palette = signal<string | null>(null);

export const showRight = (panel: RightPanel): void => void (right.value = panel);
export const showBottom = (panel: BottomPanel): void => void (bottom.value = panel);
