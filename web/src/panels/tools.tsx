// Tools of the trade: reference search, stall detection, units, configuration, firmware.
import { TOOLS, tool, type ToolName } from "../logic/views";
import { Assembler } from "./tools/assembler";
import { Chain } from "./tools/chain";
import { Configuration } from "./tools/configuration";
import { Firmware } from "./tools/firmware";
import { Profile } from "./tools/profile";
import { Reference } from "./tools/reference";
import { Stall } from "./tools/stall";
import { Registers } from "./tools/registers";
import { Units } from "./tools/units";
import { Wave } from "./tools/wave";

const VIEWS: Record<ToolName, () => preact.JSX.Element> = {
    units: Units,
    reference: Reference,
    stall: Stall,
    profile: Profile,
    configuration: Configuration,
    firmware: Firmware,
    assembler: Assembler,
    registers: Registers,
    chain: Chain,
    wave: Wave,
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
