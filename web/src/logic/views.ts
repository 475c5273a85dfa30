// Which tool and which parameters are in front; the palette opens them too.
import { remembered } from "./settings";

export const TOOLS = {
    units: "Unit calculator",
    reference: "Reference search",
    stall: "Stall detection",
    profile: "Load profile",
    configuration: "Module configuration",
    firmware: "Firmware and reset",
    assembler: "Assembler options",
    registers: "Chip registers",
    chain: "Driver chain",
    wave: "Microstep wave",
} as const;
export type ToolName = keyof typeof TOOLS;
export const tool = remembered<ToolName>("tool", "units");

export const SECTIONS = {
    axis: "Axis",
    globals: "Global",
    variables: "User variables",
    coordinates: "Coordinates",
    eeprom: "EEPROM",
} as const;
export type SectionName = keyof typeof SECTIONS;
export const section = remembered<SectionName>("parameter-section", "axis");
