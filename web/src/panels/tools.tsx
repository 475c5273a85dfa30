// Tools of the trade: reference search, stall detection, units, configuration, firmware.
import { TOOLS, tool, type ToolName } from "../logic/views";
import { Configuration } from "./tools/configuration";
import { Firmware } from "./tools/firmware";
import { Profile } from "./tools/profile";
import { Reference } from "./tools/reference";
import { Stall } from "./tools/stall";
import { Units } from "./tools/units";

const VIEWS: Record<ToolName, () => preact.JSX.Element> = {
    units: Units,
    reference: Reference,
    stall: Stall,
    profile: Profile,
    configuration: Configuration,
    firmware: Firmware,
};

export function Tools() {
    const title = TOOLS[tool.value];
    const View = VIEWS[tool.value];
    return (
        <div class="page tools">
            <nav aria-label="Tools">
                {Object.entries(TOOLS).map(([id, name]) => (
                    <button
                        key={id}
                        class={tool.value === id ? "on" : ""}
                        aria-current={tool.value === id ? "page" : undefined}
                        onClick={() => (tool.value = id as ToolName)}
                    >
                        {name}
                    </button>
                ))}
            </nav>
            <div class="scroll" tabIndex={0} aria-label={title}>
                <h2>{title}</h2>
                <View key={tool.value} />
            </div>
        </div>
    );
}
