// Stall detection: turn the motor, see its load, set the threshold.
import { rangeOf } from "../../logic/scales";
import { useComputed } from "@preact/signals";
import { ask, can, flag, motorKnown, motors, send, setAxis, welcome } from "../../logic/app";
import { notReady } from "../../logic/authority";
import { refresh } from "../../logic/parameters";
import { remembered } from "../../logic/settings";
import { Icon } from "../../widgets/icons";
import { LocalNumber, NumberField, SelectField } from "../../widgets/fields";
import { Drag } from "../bench";
import { want } from "../program";
import { Commands, MotorChoice, NoDrivers, known, motor, setting } from "./common";
import { unless, unread } from "../../logic/hindrance";

const stallSpeed = remembered<number | null>("stall-speed", 500);

const THRESHOLDS = [0, 1, 2, 3, 4, 5, 6, 7].map(value => ({ value, text: value ? `stop at load ${value}` : "off" }));

export function Stall() {
    want("axis");
    const load = useComputed(() => motors[motor.value]!.value.load);
    if (!welcome.value!.model.drivers) return <NoDrivers />;
    const threshold = known("stall_threshold");
    const told = motorKnown(motor.value, "load");
    const turn = (direction: -1 | 1) =>
        ask({ call: "turn", motor: motor.value, velocity: direction * stallSpeed.value! });
    const still = notReady.value || (stallSpeed.value === null && "Type a velocity first");
    return (
        <div class="tool-body">
            <div class="row">
                <MotorChoice />
            </div>
            <div class="grid">
                <label>
                    Velocity
                    <LocalNumber
                        value={stallSpeed.value}
                        {...rangeOf("max_speed")}
                        label="Velocity"
                        onInput={value => (stallSpeed.value = value)}
                    />
                </label>
                <label>
                    Acceleration (5)
                    <NumberField
                        value={known("max_acceleration") ?? ""}
                        hindrance={unread(known("max_acceleration"))}
                        {...rangeOf("max_acceleration")}
                        label="Acceleration"
                        onCommit={value => setAxis("max_acceleration", motor.value, value).then(refresh)}
                    />
                </label>
            </div>
            <div class="row">
                <button {...unless(still)} onClick={() => turn(-1)}>
                    <Icon name="turnLeft" /> Rotate left
                </button>
                <button onClick={() => send("MST", 0, motor.value)}>
                    <Icon name="stop" /> Stop
                </button>
                <button {...unless(still)} onClick={() => turn(1)}>
                    <Icon name="turnRight" /> Rotate right
                </button>
                {flag(motor.value, "stalled") && <span class="pill bad">stalled</span>}
            </div>
            <div class="load-scale" role="meter" aria-label="Load" aria-valuenow={load.value} aria-valuemax={7}>
                {Array.from({ length: 8 }, (_, n) => (
                    <span
                        key={n}
                        class={`${told && n <= load.value && load.value > 0 ? "on" : ""} ${threshold && n >= threshold ? "over" : ""}`}
                    >
                        {n}
                    </span>
                ))}
            </div>
            <label>
                Stall detection threshold (205)
                <SelectField
                    label="Stall threshold"
                    value={threshold ?? null}
                    choices={THRESHOLDS}
                    numbers={false}
                    hindrance={unread(threshold)}
                    onCommit={value => void setAxis("stall_threshold", motor.value, value).then(refresh)}
                />
            </label>
            {can.value.bench && (
                <div class="threshold">
                    <Drag motor={motor.value} />
                </div>
            )}
            <p class="muted note">
                Turn the motor at its working speed, see which load it shows, load it by hand until it nearly stalls,
                and set the threshold between the two. The motor is stopped when the load reaches it, not while speeding
                up or slowing down.
            </p>
            <Commands lines={[setting("stall_threshold")]} />
        </div>
    );
}
