// The unit calculator: velocity, acceleration and way in the module's units and in people's.
import { axisParameter, tables } from "../../logic/app";
import { remembered } from "../../logic/settings";
import {
    accelerationOfSlope,
    fullstepRate,
    grouped,
    rampSeconds,
    rangeText,
    rate,
    rateSlope,
    rpm,
    short,
    turns,
    ustepsPerTurn,
    velocityOfRpm,
    type Scale,
} from "../../logic/units";
import { FULLSTEPS, rangeOf } from "../../logic/scales";
import { want } from "../program";
import { Commands, MotorChoice, known, motor } from "./common";
import { LocalNumber } from "../../widgets/fields";

const steps = remembered("unit-fullsteps", FULLSTEPS);
const velocity = remembered("unit-velocity", 1000);
const acceleration = remembered("unit-acceleration", 500);
const way = remembered("unit-way", 12800);
const own = remembered<{ pulse: number; ramp: number; resolution: number } | null>("unit-own", null);

const DIVISORS = ["pulse_divisor", "ramp_divisor", "microstep_resolution"] as const;

export function Units() {
    want("axis");
    const told = DIVISORS.every(key => known(key) !== undefined);
    const [pulse, ramp, resolution] = DIVISORS.map(key => known(key) ?? axisParameter(key).default);
    const divisors = own.value ?? { pulse: pulse!, ramp: ramp!, resolution: resolution! };
    const scale: Scale = {
        clock_hz: tables.value.clock_hz,
        pulse_div: divisors.pulse,
        ramp_div: divisors.ramp,
        resolution: divisors.resolution,
        fullsteps_per_turn: steps.value,
    };
    const set = (part: Partial<typeof divisors>) => (own.value = { ...divisors, ...part });
    const top = rangeOf("max_speed");
    const place = rangeOf("target_position");
    const v = velocity.value;
    const a = acceleration.value;
    return (
        <div class="tool-body units">
            <div class="row">
                <MotorChoice />
                {own.value ? (
                    <button onClick={() => (own.value = null)}>Take the module's divisors</button>
                ) : (
                    <span class="muted">
                        {told ? "divisors as in the module" : "default divisors: those of the module are unknown"}
                    </span>
                )}
            </div>
            <div class="grid">
                <label>
                    Full steps a turn
                    <LocalNumber
                        value={steps.value}
                        low={1}
                        high={100000}
                        label="Full steps a turn"
                        onInput={value => value !== null && (steps.value = value)}
                    />
                </label>
                <label>
                    Microstep resolution (140)
                    <LocalNumber
                        value={scale.resolution}
                        {...rangeOf("microstep_resolution")}
                        label="Microstep resolution"
                        onInput={resolution => resolution !== null && set({ resolution })}
                    />
                </label>
                <label>
                    Pulse divisor (154)
                    <LocalNumber
                        value={scale.pulse_div}
                        {...rangeOf("pulse_divisor")}
                        label="Pulse divisor"
                        onInput={pulse => pulse !== null && set({ pulse })}
                    />
                </label>
                <label>
                    Ramp divisor (153)
                    <LocalNumber
                        value={scale.ramp_div}
                        {...rangeOf("ramp_divisor")}
                        label="Ramp divisor"
                        onInput={ramp => ramp !== null && set({ ramp })}
                    />
                </label>
            </div>
            <div class="columns">
                <section class="card">
                    <h3>Speed</h3>
                    <label>
                        velocity units
                        <LocalNumber
                            value={v}
                            {...rangeOf("max_speed")}
                            label="Velocity"
                            onInput={value => value !== null && (velocity.value = value)}
                        />
                    </label>
                    <label>
                        turns a minute
                        <LocalNumber
                            whole={false}
                            value={short(rpm(scale, v))}
                            label="Turns a minute"
                            low={0}
                            high={1e6}
                            onInput={value =>
                                value !== null && (velocity.value = Math.min(top.high, velocityOfRpm(scale, value)))
                            }
                        />
                    </label>
                    <dl>
                        <div>
                            <dt>turns a second</dt>
                            <dd>{short(rpm(scale, v) / 60)}</dd>
                        </div>
                        <div>
                            <dt>full steps a second</dt>
                            <dd>{short(fullstepRate(scale, v))}</dd>
                        </div>
                        <div>
                            <dt>microsteps a second</dt>
                            <dd>{grouped(rate(scale, v))}</dd>
                        </div>
                        <div>
                            <dt>one unit is</dt>
                            <dd>{short(rpm(scale, 1))} rpm</dd>
                        </div>
                        <div>
                            <dt>highest ({top.high})</dt>
                            <dd>{short(rpm(scale, top.high))} rpm</dd>
                        </div>
                    </dl>
                </section>
                <section class="card">
                    <h3>Acceleration</h3>
                    <label>
                        acceleration units
                        <LocalNumber
                            value={a}
                            {...rangeOf("max_acceleration")}
                            label="Acceleration"
                            onInput={value => value !== null && (acceleration.value = value)}
                        />
                    </label>
                    <label>
                        full steps/s²
                        <LocalNumber
                            whole={false}
                            low={0}
                            high={1e12}
                            value={short(rateSlope(scale, a) / 2 ** scale.resolution)}
                            label="Full steps per second squared"
                            onInput={value =>
                                value !== null &&
                                (acceleration.value = Math.min(
                                    rangeOf("max_acceleration").high,
                                    accelerationOfSlope(scale, value * 2 ** scale.resolution),
                                ))
                            }
                        />
                    </label>
                    <dl>
                        <div>
                            <dt>turns/s²</dt>
                            <dd>{short(rateSlope(scale, a) / ustepsPerTurn(scale))}</dd>
                        </div>
                        <div>
                            <dt>time to speed {v}</dt>
                            <dd>{short(rampSeconds(scale, v, a))} s</dd>
                        </div>
                        <div>
                            <dt>turns during the ramp</dt>
                            <dd>{short(turns(scale, (rate(scale, v) * rampSeconds(scale, v, a)) / 2))}</dd>
                        </div>
                    </dl>
                </section>
                <section class="card">
                    <h3>Distance</h3>
                    <label>
                        microsteps
                        <LocalNumber
                            value={way.value}
                            {...place}
                            label="Microsteps"
                            onInput={value => value !== null && (way.value = value)}
                        />
                    </label>
                    <label>
                        turns
                        <LocalNumber
                            whole={false}
                            value={short(turns(scale, way.value))}
                            low={-1e6}
                            high={1e6}
                            label="Turns"
                            onInput={value => value !== null && (way.value = Math.round(value * ustepsPerTurn(scale)))}
                        />
                    </label>
                    <dl>
                        <div>
                            <dt>degrees</dt>
                            <dd>{short(turns(scale, way.value) * 360)}</dd>
                        </div>
                        <div>
                            <dt>full steps</dt>
                            <dd>{short(way.value / 2 ** scale.resolution)}</dd>
                        </div>
                        <div>
                            <dt>microsteps a turn</dt>
                            <dd>{grouped(ustepsPerTurn(scale))}</dd>
                        </div>
                        <div>
                            <dt>whole range {rangeText(place.low, place.high)}</dt>
                            <dd>{short(turns(scale, place.high - place.low + 1))} turns</dd>
                        </div>
                    </dl>
                </section>
            </div>
            <Commands
                lines={[
                    `SAP ${axisParameter("max_speed").number}, ${motor.value}, ${v}`,
                    `SAP ${axisParameter("max_acceleration").number}, ${motor.value}, ${a}`,
                    ...(own.value
                        ? [
                              `SAP ${axisParameter("pulse_divisor").number}, ${motor.value}, ${scale.pulse_div}`,
                              `SAP ${axisParameter("ramp_divisor").number}, ${motor.value}, ${scale.ramp_div}`,
                          ]
                        : []),
                ]}
            />
        </div>
    );
}
