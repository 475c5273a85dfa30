// Expected figures: TMC429 datasheet 8.1.13 at 16 MHz, computed by hand.
import assert from "node:assert/strict";
import { test } from "node:test";
import {
    accelerationOfSlope,
    clockText,
    physical,
    placeText,
    grouped,
    rampSeconds,
    rate,
    rateSlope,
    rpm,
    short,
    turns,
    typed,
    velocityOfRpm,
    type Scale,
} from "../src/logic/units";

const scale: Scale = { clock_hz: 16e6, pulse_div: 3, ramp_div: 7, resolution: 6, fullsteps_per_turn: 200 };

test("one velocity unit is 244.14 Hz over two to the pulse divisor", () => {
    assert.equal(rate({ ...scale, pulse_div: 0 }, 1), 244.140625);
    assert.equal(rate(scale, 2047), (244.140625 * 2047) / 8);
});

test("acceleration is f squared a over two to the divisors plus 29", () => {
    assert.equal(rateSlope(scale, 1000), (256e12 * 1000) / 2 ** 39);
});

test("a speed in turns a minute comes back as the nearest velocity", () => {
    for (const velocity of [0, 1, 500, 2047]) assert.equal(velocityOfRpm(scale, rpm(scale, velocity)), velocity);
});

test("a slope comes back as the nearest acceleration", () => {
    for (const value of [1, 77, 2047]) assert.equal(accelerationOfSlope(scale, rateSlope(scale, value)), value);
});

test("a motor without acceleration never gets anywhere", () => {
    assert.equal(rampSeconds(scale, 100, 0), Infinity);
    assert.equal(short(Infinity), "\u221e");
});

test("a turn is full steps times microsteps", () => assert.equal(turns(scale, 12800), 1));

test("numbers are grouped with thin spaces and a true minus", () => {
    assert.equal(grouped(-1234567), "\u22121\u2009234\u2009567");
    assert.equal(grouped(0), "0");
});

test("three digits are enough", () => {
    assert.deepEqual([0, 0.1234, 1.234, 12.34, 123.4, 12345].map(short), [
        "0",
        "0.123",
        "1.23",
        "12.3",
        "123",
        "12345",
    ]);
});

test("a clock counts hours and milliseconds", () => assert.equal(clockText(3725.0426), "1:02:05.042"));

test("values are physical by the kind of their parameter", () => {
    const s = { ...scale, max_current_ma: 1100 };
    assert.equal(physical("position", "microsteps", -12800, s), "\u22121.00 turns");
    assert.equal(physical("position", "encoder steps", 5, s), "");
    assert.equal(physical("speed", "velocity units", 1000, s), "143 rpm");
    assert.equal(physical("acceleration", "acceleration units", 300, s), "10.9 turns/s\u00b2");
    assert.equal(physical("current", "1/255 of the module's maximum", 255, s), "1100 mA");
    assert.equal(physical("time", "10 ms", 200, s), "2.00 s");
    assert.equal(physical("time", "ms", 15, s), "15.0 ms");
    assert.equal(physical("number", "power of two", 3, s), "\u00f7 8");
    assert.equal(physical("flag", "", 1, s), "");
});

test("a way is what a turn moves, from a place on", () => {
    const stage = { ...scale, way: { unit: "mm", turn: -5 } };
    assert.equal(placeText(stage, 12800, 60), "55.00 mm");
});

test("a value may be typed in physical units, each as large as it is shown", () => {
    const s = { ...scale, max_current_ma: 1100 };
    assert.equal(Math.round(143 * typed("speed", "velocity units", s).rpm!), 1000);
    assert.equal(typed("position", "microsteps", s).turns, 12800);
    assert.equal(typed("time", "10 ms", s).s, 100);
    assert.equal(typed("current", "1/255 of the module's maximum", s).ma, 255 / 1100);
    assert.deepEqual(typed("flag", "", s), {});
});
