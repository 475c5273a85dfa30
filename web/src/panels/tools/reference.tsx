// The reference search assistant: its parameters, what it will do, and the search itself on the server.
import { rangeOf } from "../../logic/scales";
import { useComputed } from "@preact/signals";
import { ask, axisParameter, can, flag, motorKnown, motors, send, setAxis } from "../../logic/app";
import { abort, motionOf, notReady } from "../../logic/authority";
import { refresh } from "../../logic/parameters";
import { grouped } from "../../logic/units";
import { NumberField, SelectField } from "../../widgets/fields";
import { StopSwitch } from "../bench";
import { want } from "../program";
import { Commands, MotorChoice, known, motor, setting } from "./common";
import { offline, unless, unread } from "../../logic/hindrance";

function switchText(of: number, side: "left" | "right"): string {
    if (!motorKnown(of, "flags")) return "unknown";
    return flag(of, side) ? "closed" : "open";
}

export function Reference() {
    want("axis");
    const row = axisParameter("reference_mode");
    const mode = known("reference_mode");
    const distance = known("end_switch_distance");
    const state = useComputed(() => motors[motor.value]!.value.search);
    const set = (key: string) => (value: number) => setAxis(key, motor.value, value).then(refresh);
    const searching = state.value > 0;
    const endSearch = () => {
        const own = motionOf("search", motor.value);
        return own ? abort(own.number) : send("RFS", 1, motor.value);
    };
    const texts: Record<number, string[]> = {
        1: [
            "left at search speed until the left switch closes",
            "right at switch speed until it opens",
            "left again until it closes",
            "zero in the middle of both places",
        ],
        2: [
            "right at search speed until the right switch closes",
            "left at search speed until the left switch closes",
            "off it and on again at switch speed",
            "zero at the left switch; the way between the switches is parameter 196",
        ],
        3: [
            "right at search speed until the right switch closes",
            "left to the reference switch, past it",
            "back onto it from the other side",
            "zero in its middle; the way is parameter 196",
        ],
    };
    return (
        <div class="tool-body">
            <div class="row">
                <MotorChoice />
            </div>
            <div class="grid">
                <label>
                    Mode (193)
                    <SelectField
                        label="Referencing mode"
                        value={mode ?? null}
                        choices={row.choices}
                        hindrance={unread(known("reference_mode"))}
                        onCommit={set("reference_mode")}
                    />
                </label>
                <label>
                    Search speed (194)
                    <NumberField
                        value={known("reference_search_speed") ?? ""}
                        hindrance={unread(known("reference_search_speed"))}
                        {...rangeOf("reference_search_speed")}
                        label="Search speed"
                        onCommit={set("reference_search_speed")}
                    />
                </label>
                <label>
                    Switch speed (195)
                    <NumberField
                        value={known("reference_switch_speed") ?? ""}
                        hindrance={unread(known("reference_switch_speed"))}
                        {...rangeOf("reference_switch_speed")}
                        label="Switch speed"
                        onCommit={set("reference_switch_speed")}
                    />
                </label>
            </div>
            <ol class="steps">
                {(mode === undefined ? [] : (texts[mode] ?? [])).map(text => (
                    <li key={text}>{text}</li>
                ))}
            </ol>
            <div class="row">
                {searching ? (
                    <button class="primary" {...unless(offline.value)} onClick={endSearch}>
                        Abort the search
                    </button>
                ) : (
                    <button
                        class="primary"
                        {...unless(notReady.value)}
                        onClick={() => ask({ call: "search", motor: motor.value })}
                    >
                        Start the search
                    </button>
                )}
                <span class={`pill ${searching ? "warn" : ""}`}>
                    {searching
                        ? `searching, state ${state.value}`
                        : motorKnown(motor.value, "search")
                          ? "idle"
                          : "unknown"}
                </span>
                {can.value.bench ? (
                    <>
                        <StopSwitch motor={motor.value} side="left" />
                        <StopSwitch motor={motor.value} side="right" />
                    </>
                ) : (
                    (["left", "right"] as const).map(side => (
                        <span key={side} class={`pill ${flag(motor.value, side) ? "good" : ""}`}>
                            {side} {switchText(motor.value, side)}
                        </span>
                    ))
                )}
                <span>
                    position{" "}
                    <b>
                        {motorKnown(motor.value, "position") ? grouped(motors[motor.value]!.value.position) : "\u2013"}
                    </b>
                </span>
                <span>
                    way between switches <b>{distance === undefined ? "\u2013" : grouped(distance)}</b>
                </span>
            </div>
            <Commands
                lines={[
                    ...["reference_mode", "reference_search_speed", "reference_switch_speed"].map(setting),
                    `RFS START, ${motor.value}`,
                    `WAIT RFS, ${motor.value}, 1000`,
                ]}
            />
        </div>
    );
}
