// Who moves what: arming, STOP ALL, and what this window has under way on the server.
import { computed, effect, signal } from "@preact/signals";
import type { Authority, MotionShape } from "../wire";
import { ask, connection, forget, notify, onServerEvent, reachable, welcome } from "./app";

const NONE: Authority = {
    event: "authority",
    real: false,
    armed: false,
    latched: false,
    doubts: [],
    motions: [],
    found: "",
};
export const authority = signal<Authority>(NONE);
/** Motors may be set in motion from here. */
export const ready = computed(() => reachable.value && authority.value.armed && !authority.value.latched);
/** Why they may not, for the titles of buttons. */
export const notReady = computed(() =>
    !reachable.value
        ? "The module cannot be reached"
        : authority.value.latched
          ? "STOP ALL holds: release it first"
          : !authority.value.armed
            ? "Not armed: switch ARMED on first"
            : "",
);

export interface Point {
    velocity: number;
    mean: number;
    deviation: number;
}
export const profilePoints = signal<Point[]>([]);

/** What has been done, or is being done, to a motor or to nothing. */
export const motionOf = (kind: MotionShape["kind"], motor?: number) =>
    authority.value.motions.find(
        motion => motion.kind === kind && (motor === undefined || motion.motors.includes(motor)),
    );

onServerEvent(event => {
    if (event.event === "authority") authority.value = event;
    if (event.event === "profile_point") profilePoints.value = [...profilePoints.value, event];
    if (event.event === "motion_ended" && event.text)
        notify(event.complete ? "information" : "warning", event.text, undefined, event.kind);
});

/** The server ends what belongs to a window that says nothing: say something while there is such a thing. */
const AGAIN_MS = 500;
const own = computed(() => authority.value.motions.some(motion => motion.window === welcome.value?.window));
let timer = 0;
effect(() => {
    clearInterval(timer);
    if (own.value) timer = window.setInterval(() => void connection.call({ call: "ping" }).catch(() => {}), AGAIN_MS);
});

effect(() => {
    if (ready.value) forget("disarmed", "latched", "silent");
});

export const arm = (on: boolean): Promise<unknown> => ask({ call: "arm", on });
export const release = (): Promise<unknown> => ask({ call: "release" });
export const dismissFound = (): Promise<unknown> => ask({ call: "dismiss" });
export const abort = (number: number): Promise<unknown> => ask({ call: "abort", number });
