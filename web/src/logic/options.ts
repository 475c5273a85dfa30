// How programs are assembled; remembered by the browser.
import type { BuildOptions } from "../wire";
import { remembered } from "./settings";

/** As the TMCL-IDE has it: for the module at hand, with a STOP at the end. */
export const PLAIN: BuildOptions = { model: 0, append_stop: true };
export const options = remembered<BuildOptions>("build-options", PLAIN);
