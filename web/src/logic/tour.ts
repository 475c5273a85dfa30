// The guided tour: a few places of the page, one after the other; once seen or skipped it is not offered again.
import { signal } from "@preact/signals";
import { remembered } from "./settings";

export interface Stop {
    /** What is pointed at; a place that is not shown is left out. */
    selector: string;
    title: string;
    text: string;
}

export const STOPS: Stop[] = [
    {
        selector: ".middle .work",
        title: "Your program",
        text: "Write TMCL here, or open an example. Errors are underlined as you type; hovering explains a word. A click left of a line number sets a breakpoint.",
    },
    {
        selector: ".top .group",
        title: "Run it",
        text: "Run (F9) assembles what is on the screen, stores it in the module and starts it. Step executes one command.",
    },
    {
        selector: ".right",
        title: "The motors",
        text: "Each dial is a motor. Hold an arrow to turn it, or give it a position. Bench, beside it, closes switches and blocks shafts of a virtual machine.",
    },
    {
        selector: ".bottom",
        title: "See what happens",
        text: "Plot draws positions and speeds, Direct mode sends single commands, Telegrams shows all traffic, also that of other hosts.",
    },
    {
        selector: ".lane .place",
        title: "Which module",
        text: "Virtual at first: nothing can break. A click here connects to a real module, which must be armed before anything moves.",
    },
    {
        selector: ".stop-all",
        title: "Stop",
        text: "STOP ALL (F10) stops program and motors at any time, and holds until you release it.",
    },
];

export const tourSeen = remembered("tour-seen", false);
/** Number of the present stop; null while there is no tour. */
export const tourAt = signal<number | null>(null);

const isShown = ({ selector }: Stop): boolean => {
    const box = document.querySelector(selector)?.getBoundingClientRect();
    return !!box && box.width > 0 && box.height > 0;
};

/** Go to the next stop that is shown, or to one before; past the last one the tour ends. */
export function goOn(step: 1 | -1, from = tourAt.peek()!): void {
    let at = from + step;
    while (at >= 0 && at < STOPS.length && !isShown(STOPS[at]!)) at += step;
    if (at >= STOPS.length) endTour();
    else if (at >= 0) {
        document.querySelector(STOPS[at]!.selector)!.scrollIntoView({ block: "nearest" });
        tourAt.value = at;
    }
}

export const beginTour = (): void => goOn(1, -1);
export function endTour(): void {
    tourAt.value = null;
    tourSeen.value = true;
}
