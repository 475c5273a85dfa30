// What a motor does, in words.
import { age, figures, motorKnown, powered } from "../../logic/app";
import { grouped } from "../../logic/units";
import { MOTOR_FLAGS } from "../../wire";

/** What a motor does, in words that are true of the values that came last. */
export function stateOf(motor: number): string {
    if (!powered.value) return "no power";
    if (age.value === null) return "unknown";
    if (age.value > 0) return `as of ${age.value} s ago`;
    if (
        !(["speed", "target", "target_speed", "mode", "flags", "search"] as const).every(name =>
            motorKnown(motor, name),
        )
    )
        return "unknown";
    const { speed, target, target_speed: wanted, mode, search, slip, flags } = figures[motor]!.value;
    const on = (name: keyof typeof MOTOR_FLAGS) => (flags & MOTOR_FLAGS[name]) !== 0;
    if (search) return `reference search, step ${search}`;
    if (on("stalled")) return "stalled";
    if (slip) return `${Math.abs(slip)} full steps lost`;
    const way = mode === 0 ? target - figures[motor]!.value.position : wanted;
    if (!speed && way < 0 && on("left") && !on("left_off")) return "stopped by the left switch";
    if (!speed && way > 0 && on("right") && !on("right_off")) return "stopped by the right switch";
    if (mode === 0)
        return on("reached")
            ? "at target"
            : speed
              ? `moving to ${grouped(target)}`
              : `stands, target ${grouped(target)}`;
    if (!speed && !wanted) return "stopped";
    return speed === wanted
        ? `turning ${speed > 0 ? "right" : "left"}`
        : wanted
          ? `turning ${wanted > 0 ? "right" : "left"}, ramp`
          : "slowing down";
}
