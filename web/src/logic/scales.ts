// The scale of each motor's units, from its parameters as last read, and what numbers are in physical units.
import type { Parameter } from "../wire";
import type { Units } from "./text";
import { axisParameter, figures, tables, welcome, world } from "./app";
import { physical, placeText, typed, type Scale } from "./units";

/** Of a turn of the usual motor, 1.8 degrees. */
export const FULLSTEPS = 200;
export const fullstepsOf = (motor: number): number => world.value?.axes[motor]?.fullsteps ?? FULLSTEPS;

/** The range of an axis parameter, for fields. */
export function rangeOf(key: string): { low: number; high: number } {
    const { low, high } = axisParameter(key);
    return { low, high };
}

/** What a turn moves, where the bench says more of the axis than that: its ends or its switches. */
function wayOf(motor: number): Scale["way"] {
    const axis = world.value?.axes[motor];
    if (!axis || (axis.unit === "mm" && axis.low === null && axis.high === null && !axis.cams.length)) return undefined;
    return { unit: axis.unit, turn: axis.turn };
}

/** Scale of a motor's units. */
export function scaleOf(motor: number): Scale {
    const { pulse_div, ramp_div, resolution } = figures[motor]!.value;
    return {
        clock_hz: tables.value.clock_hz,
        pulse_div,
        ramp_div,
        resolution,
        fullsteps_per_turn: fullstepsOf(motor),
        way: wayOf(motor),
        max_current_ma: welcome.value?.model.max_current_ma ?? 0,
    };
}

/** A position of a motor in physical units: where the load then is on its bench, or turns of the motor from zero. */
export function placeOf(motor: number, usteps: number): string {
    const scale = scaleOf(motor);
    const { place, position } = figures[motor]!.value;
    if (!scale.way) return placeText(scale, usteps);
    return placeText(scale, usteps - position, place);
}

/** Units in which a value of a parameter may be typed, and how much one of each is. */
export const unitsOf = (row: Parameter, motor: number): Units => typed(row.kind, row.unit, scaleOf(motor));

/** A parameter's value in physical units; empty where it has none. */
export const physicalOf = (row: Parameter, motor: number, value: number): string =>
    physical(row.kind, row.unit, value, scaleOf(motor));
