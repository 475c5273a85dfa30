// Tools of the trade: reference search, stall detection, units, configuration, firmware.
import { remembered } from "../logic/settings";
import { Configuration } from "./tools/configuration";
import { Firmware } from "./tools/firmware";
import { Profile } from "./tools/profile";
import { Reference } from "./tools/reference";
import { Stall } from "./tools/stall";
import { Units } from "./tools/units";

const TOOLS = {
    units: ["Unit calculator", Units], reference: ["Reference search", Reference], stall: ["Stall detection", Stall],
    profile: ["Load profile", Profile], configuration: ["Module configuration", Configuration], firmware: ["Firmware and reset", Firmware],
} as const;
export const tool = remembered<keyof typeof TOOLS>("tool", "units");

export function Tools() {
    const [title, View] = TOOLS[tool.value];
    return (
        <div class="page tools">
            <nav aria-label="Tools">{Object.entries(TOOLS).map(([id, [name]]) => (
                <button key={id} class={tool.value === id ? "on" : ""} aria-current={tool.value === id ? "page" : undefined} onClick={() => (tool.value = id as keyof typeof TOOLS)}>{name}</button>))}</nav>
            <div class="scroll" tabIndex={0} aria-label={title}><h2>{title}</h2><View key={tool.value} /></div>
        </div>
    );
}
