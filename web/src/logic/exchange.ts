// Settings as files: out of the module and into it.
import { offer } from "../widgets/basics";
import { ask, notify } from "./app";
import { refresh } from "./parameters";

export async function exportSettings(format: "tmcl" | "toml"): Promise<void> {
    const text = await ask({ call: "export_settings", format });
    if (text !== null) offer(format === "tmcl" ? "settings.tmc" : "settings.toml", text);
}

async function importSettings(file: File): Promise<void> {
    const exchanges = await ask({ call: "import_settings", text: await file.text() });
    if (!exchanges) return;
    const bad = exchanges.filter(exchange => exchange.status !== 100);
    const silent = bad.filter(exchange => !exchange.status).length;
    if (bad.length)
        notify(
            "warning",
            `${bad.length} of ${exchanges.length} settings are not set: ${bad.length - silent} were refused, ${silent} had no reply. The first: ${bad[0]!.text}, ${bad[0]!.meaning}.`,
        );
    else notify("information", `${exchanges.length} settings taken over. They last until power-off unless stored.`);
    await refresh();
}

/** Let a person choose a file of settings, and take it over. */
export function pickSettings(): void {
    const field = document.createElement("input");
    field.type = "file";
    field.accept = ".tmc,.toml";
    field.onchange = () => field.files?.[0] && void importSettings(field.files[0]);
    field.click();
}
