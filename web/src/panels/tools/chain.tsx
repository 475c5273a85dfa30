// The driver chain of the motion chip: which signal stands at which bit of the drivers' datagram.
import { CHAIN_END, SIGNALS, tmc246Chain } from "../../logic/chip_tables";
import { Apply, NotRead, useDraft } from "./chip-table";

const SIGNAL = 0x1f;
const PRESETS = [
    ["off", "mixed decay off"],
    ["falling", "mixed decay in the falling current"],
    ["on", "mixed decay always (the chip's own after power-on)"],
] as const;

/** For each cell the driver it belongs to; 0 behind the end of the third. */
function drivers(table: readonly number[]): number[] {
    let driver = 1;
    return table.map(cell => {
        const own = driver <= 3 ? driver : 0;
        if (cell & CHAIN_END) driver++;
        return own;
    });
}

export function Chain() {
    const draft = useDraft("driver_chain");
    if (!draft) return <NotRead icon="list" name="driver_chain" what="chain" />;
    const { known, shown, set } = draft;
    const owners = drivers(shown);
    const ends = shown.filter(cell => cell & CHAIN_END).length;
    return (
        <div class="tool-body chip-table">
            <p class="muted note">
                The bits of a datagram to the drivers, the first one sent at the top. An end mark closes the part of a
                driver; without any the chip never ends a datagram.
            </p>
            <div class="row">
                <label>
                    Chain of three TMC236 or TMC246
                    <select
                        aria-label="Chain of three TMC236 or TMC246"
                        value=""
                        onChange={event => {
                            const decay = event.currentTarget.value as "off" | "falling" | "on" | "";
                            if (decay) draft.take(tmc246Chain(decay));
                            event.currentTarget.value = "";
                        }}
                    >
                        <option value="">choose…</option>
                        {PRESETS.map(([id, text]) => (
                            <option key={id} value={id}>
                                {text}
                            </option>
                        ))}
                    </select>
                </label>
                {ends !== 3 && <span class="pill bad">{ends} end marks: three drivers need three</span>}
            </div>
            <Apply draft={draft} title="Another driver chain" />
            <div class="chain">
                {shown.map((cell, at) => (
                    <div key={at} class={`chain-cell driver${owners[at]} ${cell !== known[at] ? "unsent" : ""}`}>
                        <span>{at}</span>
                        <select
                            aria-label={`Signal of cell ${at}`}
                            value={String(cell & SIGNAL)}
                            onChange={event => set(at, (cell & CHAIN_END) | Number(event.currentTarget.value))}
                        >
                            {SIGNALS.map((name, code) => (
                                <option key={name} value={String(code)}>
                                    {name}
                                </option>
                            ))}
                            {(cell & SIGNAL) >= SIGNALS.length && (
                                <option value={String(cell & SIGNAL)}>unused {cell & SIGNAL}</option>
                            )}
                        </select>
                        <label title="Last bit of its driver">
                            <input
                                type="checkbox"
                                aria-label={`Cell ${at} ends its driver`}
                                checked={!!(cell & CHAIN_END)}
                                onChange={event =>
                                    set(at, event.currentTarget.checked ? cell | CHAIN_END : cell & SIGNAL)
                                }
                            />{" "}
                            end
                        </label>
                        <span class="muted">{owners[at] ? `driver ${owners[at]}` : "not sent"}</span>
                    </div>
                ))}
            </div>
        </div>
    );
}
