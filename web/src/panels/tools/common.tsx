// What the tools share: the chosen motor, its parameters, lines to copy.
import { axisParameter, welcome } from "../../logic/app";
import { parameters } from "../../logic/parameters";
import { remembered } from "../../logic/settings";
import { Choice, Empty } from "../../widgets/basics";
import { Icon } from "../../widgets/icons";
import { insertIntoEditor } from "../direct";
import { unless } from "../../logic/hindrance";

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
/** In place of an operand that is not known. */
const UNKNOWN = "?";
/** Command that sets a parameter of the chosen motor to what it is now. */
export const setting = (key: string): string =>
    `SAP ${axisParameter(key).number}, ${motor.value}, ${known(key) ?? UNKNOWN}`;

/** Lines to copy into a program, once all in them is known. */
export function Commands({ lines }: { lines: string[] }) {
    return (
        <div class="commands">
            <pre>{lines.join("\n")}</pre>
            <button
                {...unless(lines.some(line => line.includes(UNKNOWN)) && "Not all of it is read from the module yet")}
                onClick={() => lines.slice().reverse().forEach(insertIntoEditor)}
            >
                <Icon name="copy" /> Copy to the editor
            </button>
        </div>
    );
}

export const NoDrivers = () => (
    <Empty icon="info" title="No load measurement">
        The drivers of a {welcome.value!.model.name} are outside, behind its step and direction outputs: it does not
        measure their load.
    </Empty>
);
