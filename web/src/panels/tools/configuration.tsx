// The module's configuration: addresses, rates, what happens at power-on.
import { send, tables } from "../../logic/app";
import { parameters, refresh } from "../../logic/parameters";
import { NumberField, SelectField } from "../../widgets/fields";
import { want } from "../program";
import { offline, unless, unread } from "../../logic/hindrance";

const CONFIGURATION = [
    [
        "Serial line",
        ["serial_address", "host_address", "baud_rate", "telegram_pause", "serial_heartbeat", "ascii_mode"],
    ],
    ["CAN", ["can_bit_rate", "can_id", "can_reply_id", "can_secondary_id"]],
    [
        "Start and protection",
        [
            "auto_start",
            "code_protection",
            "eeprom_lock",
            "shutdown_pin",
            "encoder_interface",
            "coordinate_storage",
            "keep_user_variables_cleared",
        ],
    ],
] as const;

export function Configuration() {
    want("globals");
    const value = (bank: number, number: number) => parameters.value.globals.get(`${bank}/${number}`);
    return (
        <div class="tool-body columns">
            {CONFIGURATION.map(([title, keys]) => (
                <section class="card" key={title}>
                    <h3>{title}</h3>
                    {keys.map(key => {
                        const row = tables.value.globals.find(item => item.key === key);
                        if (!row) return null;
                        const now = value(row.bank, row.number);
                        const set = (next: number) => send("SGP", row.number, row.bank, next).then(refresh);
                        if (key === "eeprom_lock")
                            return (
                                <label key={key} title={row.meaning}>
                                    {row.name} ({row.number})
                                    <span class="row">
                                        <span class={`pill ${now == null ? "" : now ? "warn" : "good"}`}>
                                            {now == null ? "unknown" : now ? "locked" : "unlocked"}
                                        </span>
                                        <button
                                            {...unless(offline.value || unread(now))}
                                            onClick={() => set(now ? 4321 : 1234)}
                                        >
                                            {now ? "Unlock" : "Lock"}
                                        </button>
                                    </span>
                                </label>
                            );
                        return (
                            <label key={key} title={row.meaning}>
                                {row.name} ({row.number})
                                {now == null ? (
                                    <span class="muted">–</span>
                                ) : row.choices.length ? (
                                    <SelectField
                                        label={row.name}
                                        value={now}
                                        choices={row.choices}
                                        numbers={false}
                                        hindrance={offline.value}
                                        onCommit={set}
                                    />
                                ) : (
                                    <NumberField
                                        value={now}
                                        low={row.low}
                                        high={row.high}
                                        label={row.name}
                                        hindrance={offline.value}
                                        onCommit={set}
                                    />
                                )}
                            </label>
                        );
                    })}
                </section>
            ))}
            <p class="muted note">
                Each change is stored in the EEPROM at once. A new address or baud rate holds from the next command on.
            </p>
        </div>
    );
}
