// Light or dark: as chosen, or as the system has it.
import { effect } from "@preact/signals";
import { theme } from "./layout";

export const shownTheme = (): "dark" | "light" =>
    theme.value || (matchMedia("(prefers-color-scheme: light)").matches ? "light" : "dark");
effect(() => {
    document.documentElement.dataset.theme = shownTheme();
});
