// Conversions between the chip's units and physical ones.
// Source: TMC429 datasheet 8.1.13: R = f v / (2^pulse_div 2048 32), dR/dt = f^2 a / 2^(pulse_div + ramp_div + 29).

export interface Scale {
    clock_hz: number;
    pulse_div: number;
    ramp_div: number;
    /** Axis parameter 140: microsteps of a full step are 2 to this. */
    resolution: number;
    fullsteps_per_turn: number;
    /** What a turn of the motor moves, where a bench says so; negative the other way. */
    way?: { unit: string; turn: number };
    /** Current of setting 255; 0 where the module does not say it. */
    max_current_ma?: number;
}

/** Setting of the largest current. */
export const FULL_CURRENT = 255;

/** Microsteps a second. */
export const rate = (s: Scale, velocity: number): number => (s.clock_hz * velocity) / (2 ** s.pulse_div * 2048 * 32);

/** Microsteps a second squared. */
export const rateSlope = (s: Scale, acceleration: number): number =>
    (s.clock_hz ** 2 * acceleration) / 2 ** (s.pulse_div + s.ramp_div + 29);

export const ustepsPerTurn = (s: Scale): number => s.fullsteps_per_turn * 2 ** s.resolution;
export const fullstepRate = (s: Scale, velocity: number): number => rate(s, velocity) / 2 ** s.resolution;
export const rpm = (s: Scale, velocity: number): number => (rate(s, velocity) / ustepsPerTurn(s)) * 60;
export const turns = (s: Scale, usteps: number): number => usteps / ustepsPerTurn(s);

/** The nearest velocity setting for a speed in turns a minute. */
export const velocityOfRpm = (s: Scale, speed: number): number =>
    Math.round(((speed / 60) * ustepsPerTurn(s) * 2 ** s.pulse_div * 2048 * 32) / s.clock_hz);

export const accelerationOfSlope = (s: Scale, slope: number): number =>
    Math.round((slope * 2 ** (s.pulse_div + s.ramp_div + 29)) / s.clock_hz ** 2);

/** Seconds to come from rest to `velocity`. */
export const rampSeconds = (s: Scale, velocity: number, acceleration: number): number =>
    acceleration === 0 ? Infinity : rate(s, velocity) / rateSlope(s, acceleration);

const DIGITS = new Intl.NumberFormat("en", { maximumFractionDigits: 0 });

/** A whole number with thin spaces between thousands and a true minus sign. */
export const grouped = (value: number): string => DIGITS.format(value).replace(/,/g, "\u2009").replace("-", "\u2212");

/** Three significant digits. */
export function short(value: number): string {
    if (!Number.isFinite(value)) return "\u221e";
    const size = Math.abs(value);
    const digits = size >= 100 || size === 0 ? 0 : size >= 10 ? 1 : size >= 1 ? 2 : 3;
    return value.toFixed(digits).replace("-", "\u2212");
}

/** A position as turns of the motor, or as the way that they move, from a place on. */
export const placeText = (s: Scale, usteps: number, from = 0): string =>
    s.way
        ? `${(from + turns(s, usteps) * s.way.turn).toFixed(2).replace("-", "\u2212")} ${s.way.unit}`
        : `${turns(s, usteps).toFixed(2).replace("-", "\u2212")} turns`;

const seconds = (value: number): string => (value < 1 ? `${short(value * 1000)} ms` : `${short(value)} s`);

/** A value of a parameter in physical units, by its kind and unit (src/tmcm34x/tmcl/axis_parameters.py); empty for none. */
export function physical(kind: string, unit: string, value: number, s: Scale): string {
    switch (kind) {
        case "position":
            return unit === "microsteps" ? placeText(s, value) : "";
        case "speed":
            return `${short(rpm(s, value))} rpm`;
        case "acceleration":
            return `${short(rateSlope(s, value) / ustepsPerTurn(s))} turns/s\u00b2`;
        case "current":
            return s.max_current_ma ? `${Math.round((value / FULL_CURRENT) * s.max_current_ma)} mA` : "";
        case "time":
            return unit === "10 ms" ? seconds(value / 100) : seconds(value / 1000);
        default:
            return unit === "power of two" ? `\u00f7 ${2 ** value}` : "";
    }
}

/** Units in which a value of a parameter may be typed, and how much one of each is. */
export function typed(kind: string, unit: string, s: Scale): Record<string, number> {
    const turn = ustepsPerTurn(s);
    switch (kind) {
        case "position":
            return unit === "microsteps" ? { turns: turn, turn, "\u00b0": turn / 360 } : {};
        case "speed":
            return { rpm: 1 / rpm(s, 1) };
        case "current":
            return s.max_current_ma
                ? { ma: FULL_CURRENT / s.max_current_ma, a: (1000 * FULL_CURRENT) / s.max_current_ma }
                : {};
        case "time":
            return unit === "10 ms" ? { ms: 0.1, s: 100 } : { ms: 1, s: 1000 };
        default:
            return {};
    }
}

const RAISED = "\u2070\u00b9\u00b2\u00b3\u2074\u2075\u2076\u2077\u2078\u2079";
const power = (exponent: number): string => `2${[...String(exponent)].map(digit => RAISED[Number(digit)]).join("")}`;
/** From which on a range that is a power of two is written as one. */
const LONG = 2 ** 20;

/** A range in few letters. */
export function rangeText(low: number, high: number): string {
    const exponent = Math.log2(high + 1);
    if (high >= LONG && Number.isInteger(exponent) && low === -(high + 1)) return `\u00b1${power(exponent)}`;
    if (high >= LONG && Number.isInteger(exponent) && low === 0) return `0\u2026${power(exponent)}`;
    return `${low}\u2026${high}`.replace(/-/g, "\u2212");
}

/** Virtual time as hours, minutes, seconds, milliseconds. */
export function clockText(seconds: number): string {
    const ms = Math.floor(seconds * 1000);
    const pad = (value: number, width: number) => String(value).padStart(width, "0");
    const parts = [pad(Math.floor(ms / 60000) % 60, 2), pad(Math.floor(ms / 1000) % 60, 2)];
    return `${Math.floor(ms / 3600000)}:${parts.join(":")}.${pad(ms % 1000, 3)}`;
}
