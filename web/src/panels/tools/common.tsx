// What the tools share: the chosen motor, its parameters, lines to copy.
import { axisParameter, welcome } from "../../logic/app";
import { parameters } from "../../logic/parameters";
import { remembered } from "../../logic/settings";
import { Choice, Empty } from "../../widgets/basics";
import { Icon } from "../../widgets/icons";
import { insertIntoEditor } from "../direct";

export const motor = remembered("tool-motor", 0);
export const MotorChoice = () => (
    <Choice
        label="Motor"
        value={motor.value}
        options={
            [
                [0, "Motor 0"],
                [1, "Motor 1"],
                [2, "Motor 2"],
            ] as const
        }
        onChange={value => (motor.value = value)}
    />
);
/** A parameter of the chosen motor as last read; undefined while it is not known. */
export const known = (key: string): number | undefined =>
    parameters.value.axis.get(axisParameter(key).number)?.[motor.value] ?? undefined;
/** The same for reckoning: the default while it is not known. */
export const parameterValue = (key: string): number => known(key) ?? axisParameter(key).default;

/** Lines to copy into a program. */
export function Commands({ lines }: { lines: string[] }) {
    return (
        <div class="commands">
            <pre>{lines.join("\n")}</pre>
            <button onClick={() => lines.slice().reverse().forEach(insertIntoEditor)}>
                <Icon name="copy" /> Copy to the editor
            </button>
        </div>
    );
}

export const NoDrivers = () => (
    <Empty icon="info" title="No load measurement">
        The drivers of a {welcome.value!.model.name} are outside, behind its step and direction outputs: it cannot tell
        their load.
    </Empty>
);
