// What a press of an arrow does: turn while it is held, or move by a step.
import { figures, world } from "../../logic/app";
import { fullstepsOf } from "../../logic/scales";
import { remembered } from "../../logic/settings";

export const jogSpeed = remembered<(number | null)[]>("jog", [400, 400, 400]);
export const moveTo = remembered<(number | null)[]>("move", [10000, 10000, 10000]);

/** What a press of an arrow does: 0 turns while it is held, else it moves by so many microsteps, full steps or degrees. */
const STRIDES = [
    ["hold", "hold"],
    ["1", "1 \u00b5step"],
    ["10", "10 \u00b5steps"],
    ["100", "100 \u00b5steps"],
    ["fullstep", "1 full step"],
    ["1deg", "1\u00b0"],
    ["10deg", "10\u00b0"],
    ["mm", "1 mm"],
] as const;
export type Stride = (typeof STRIDES)[number][0];
export const strides = remembered<Stride[]>("strides", ["hold", "hold", "hold"]);

/** Microsteps of a stride of a motor. */
export function microsteps(motor: number, stride: Stride): number {
    const { resolution } = figures[motor]!.value;
    const axis = world.value?.axes[motor];
    const turn = fullstepsOf(motor) * 2 ** resolution;
    switch (stride) {
        case "fullstep":
            return 2 ** resolution;
        case "1deg":
            return Math.round(turn / 360);
        case "10deg":
            return Math.round(turn / 36);
        case "mm":
            return axis ? Math.round(turn / Math.abs(axis.turn)) : 0;
        default:
            return Number(stride);
    }
}

/** Millimetres are offered where a bench says what one is. */
export const stridesOf = (motor: number) =>
    STRIDES.filter(([stride]) => stride !== "mm" || world.value?.axes[motor]?.unit === "mm");
