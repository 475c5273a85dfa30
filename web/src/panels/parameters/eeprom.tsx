// The EEPROM of a virtual module.
import { useSignal } from "@preact/signals";
import { useEffect } from "preact/hooks";
import { ask, can, tables } from "../../logic/app";
import { COORDINATE_BANK } from "../../logic/parameters";
import { Empty } from "../../widgets/basics";
import type { Eeprom, StoredValue } from "../../wire";

export function EepromView() {
    const eeprom = useSignal<Eeprom | null>(null);
    const load = () => void ask({ call: "read_eeprom" }).then(found => (eeprom.value = found));
    useEffect(() => {
        if (can.value.bench) load();
    }, []);
    if (!can.value.bench)
        return (
            <Empty icon="table" title="Not readable over the line">
                A real module shows its EEPROM only by RSAP and RSGP, value by value.
            </Empty>
        );
    const found = eeprom.value;
    if (!found) return <Empty icon="table" title="Reading…" />;
    const bytes = found.image.match(/../g) ?? [];
    const rows: string[] = [];
    for (let at = 0; at < Math.min(bytes.length, 4096); at += 16) {
        const part = bytes.slice(at, at + 16);
        const text = part
            .map(byte => {
                const code = parseInt(byte, 16);
                return code >= 32 && code < 127 ? String.fromCharCode(code) : "·";
            })
            .join("");
        rows.push(`${at.toString(16).padStart(5, "0")}  ${part.join(" ").padEnd(47)}  ${text}`);
    }
    const of = ({ bank, motor }: StoredValue) =>
        bank === -1 || bank === COORDINATE_BANK ? `motor ${motor}` : `bank ${bank}`;
    const name = (bank: number, number: number) =>
        bank === COORDINATE_BANK
            ? `coordinate ${number}`
            : ((bank === -1 ? tables.value.axis : tables.value.globals.filter(row => row.bank === bank)).find(
                  row => row.number === number,
              )?.name ?? "");
    return (
        <div class="eeprom">
            <p class="muted note">
                {found.file ? (
                    <>
                        Kept in <code>{found.file}</code>.
                    </>
                ) : (
                    "Kept in memory only: it is lost when the IDE ends."
                )}{" "}
                {bytes.length} bytes. <button onClick={load}>Read again</button>
            </p>
            <div class="columns">
                <table class="stored">
                    <thead>
                        <tr>
                            <th>no.</th>
                            <th>stored parameter</th>
                            <th>of</th>
                            <th>value</th>
                        </tr>
                    </thead>
                    <tbody>
                        {found.values.map(value => (
                            <tr key={`${value.bank}/${value.number}/${value.motor}`}>
                                <td class="no">{value.number}</td>
                                <td>{name(value.bank, value.number)}</td>
                                <td class="muted">{of(value)}</td>
                                <td class="value">{value.value}</td>
                            </tr>
                        ))}
                    </tbody>
                </table>
                <pre class="hex">
                    {rows.join("\n")}
                    {bytes.length > 4096 ? "\n…" : ""}
                </pre>
            </div>
        </div>
    );
}
