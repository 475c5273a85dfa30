// A signal that follows another one no faster than a person reads.
import { effect, signal, untracked, type ReadonlySignal } from "@preact/signals";

/** How much longer it waits for a change that comes anyway, so that its own is painted in the same frame. */
const GRACE_MS = 150;

/** Follows `source` after `pauseMs` at the soonest, to its last value always; at once where `atOnce` says so. */
export function paced<T>(source: ReadonlySignal<T>, pauseMs: number, atOnce: () => boolean): ReadonlySignal<T> {
    const shown = signal(source.peek());
    let next = 0;
    let timer = 0;
    const take = () => {
        clearTimeout(timer);
        timer = 0;
        next = performance.now() + pauseMs;
        shown.value = source.peek();
    };
    effect(() => {
        void source.value;
        const wait = next - performance.now();
        if (wait <= 0 || untracked(atOnce)) take();
        else timer ||= window.setTimeout(take, wait + GRACE_MS);
    });
    return shown;
}
