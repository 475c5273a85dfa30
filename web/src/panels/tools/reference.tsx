// The reference search assistant: its parameters, what it will do, and the search itself on the server.
import { rangeOf } from "../../logic/scales";
import { useComputed } from "@preact/signals";
import { ask, axisParameter, can, flag, motors, online, send, setAxis } from "../../logic/app";
import { abort, motionOf, notReady, ready } from "../../logic/authority";
import { refresh } from "../../logic/parameters";
import { grouped } from "../../logic/units";
import { NumberField, SelectField } from "../../widgets/fields";
import { StopSwitch } from "../bench";
import { want } from "../program";
import { Commands, MotorChoice, known, motor, parameterValue } from "./common";

export function Reference() {
    want("axis");
    const row = axisParameter("reference_mode");
    const mode = parameterValue("reference_mode");
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
                        value={mode}
                        choices={row.choices}
                        disabled={known("reference_mode") === undefined}
                        onCommit={set("reference_mode")}
                    />
                </label>
                <label>
                    Search speed (194)
                    <NumberField
                        value={known("reference_search_speed") ?? ""}
                        disabled={known("reference_search_speed") === undefined}
                        {...rangeOf("reference_search_speed")}
                        label="Search speed"
                        onCommit={set("reference_search_speed")}
                    />
                </label>
                <label>
                    Switch speed (195)
                    <NumberField
                        value={known("reference_switch_speed") ?? ""}
                        disabled={known("reference_switch_speed") === undefined}
                        {...rangeOf("reference_switch_speed")}
                        label="Switch speed"
                        onCommit={set("reference_switch_speed")}
                    />
                </label>
            </div>
            <ol class="steps">
                {(texts[mode] ?? []).map(text => (
                    <li key={text}>{text}</li>
                ))}
            </ol>
            <div class="row">
                {searching ? (
                    <button class="primary" disabled={!online.value} onClick={endSearch}>
                        Abort the search
                    </button>
                ) : (
                    <button
                        class="primary"
                        disabled={!ready.value}
                        title={notReady.value || undefined}
                        onClick={() => ask({ call: "search", motor: motor.value })}
                    >
                        Start the search
                    </button>
                )}
                <span class={`pill ${searching ? "warn" : ""}`}>
                    {searching ? `searching, state ${state.value}` : "idle"}
                </span>
                {can.value.bench ? (
                    <>
                        <StopSwitch motor={motor.value} side="left" />
                        <StopSwitch motor={motor.value} side="right" />
                    </>
                ) : (
                    (["left", "right"] as const).map(side => (
                        <span key={side} class={`pill ${flag(motor.value, side) ? "good" : ""}`}>
                            {side} {flag(motor.value, side) ? "closed" : "open"}
                        </span>
                    ))
                )}
                <span>
                    position <b>{grouped(motors[motor.value]!.value.position)}</b>
                </span>
                <span>
                    way between switches{" "}
                    <b>
                        {known("end_switch_distance") === undefined
                            ? "\u2013"
                            : grouped(parameterValue("end_switch_distance"))}
                    </b>
                </span>
            </div>
            <Commands
                lines={[
                    `SAP 193, ${motor.value}, ${mode}`,
                    `SAP 194, ${motor.value}, ${parameterValue("reference_search_speed")}`,
                    `SAP 195, ${motor.value}, ${parameterValue("reference_switch_speed")}`,
                    `RFS START, ${motor.value}`,
                    `WAIT RFS, ${motor.value}, 1000`,
                ]}
            />
        </div>
    );
}
