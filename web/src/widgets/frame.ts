// What follows each frame of values without rendering.
import { effect } from "@preact/signals";
import { useLayoutEffect, useRef } from "preact/hooks";

/**
 * Follow signals at once, so that what is moved is painted with the values that render.
 *
 * `useSignalEffect` waits for the frame behind, which doubles the frames of a page whose values change 20 times a second.
 */
export function useFrameEffect(follow: () => void): void {
    const newest = useRef(follow);
    newest.current = follow;
    useLayoutEffect(() => effect(() => newest.current()), []);
}
