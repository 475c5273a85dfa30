// Settings as files: out of the module and into it.
import { offer } from "../widgets/basics";
import { ask, notify } from "./app";
import { refresh } from "./parameters";
import { base64, pickFile } from "./pick";

export async function exportSettings(format: "tmcl" | "toml"): Promise<void> {
    const text = await ask({ call: "export_settings", format });
    if (text !== null) offer(format === "tmcl" ? "settings.tmc" : "settings.toml", text);
}

async function importSettings(file: File): Promise<void> {
    const done = await ask({ call: "import_settings", file: await base64(file) });
    if (!done) return;
    const { count, refused } = done;
    if (refused.length)
        notify("warning", `${refused.length} of ${count} settings were refused. The first: ${refused[0]}.`);
    else
        notify(
            "information",
            `${count === 1 ? "1 setting" : `${count} settings`} taken over until power-off, unless stored.`,
        );
    await refresh();
}

/** Let a person choose a file of settings, and take it over. */
export const pickSettings = (): void => pickFile(".tmc,.toml", importSettings);
