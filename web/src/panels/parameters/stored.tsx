// User variables and coordinates.
import { ask, axisParameter, send, tables } from "../../logic/app";
import { notReady } from "../../logic/authority";
import { COORDINATE_BANK, globalValue, keyOf, parameters, refresh, touched } from "../../logic/parameters";
import { NumberField } from "../../widgets/fields";
import { WhoWrote, WhoWroteOf } from "../past";
import { want } from "../program";
import { IconButton } from "../../widgets/basics";
import { offline, unless, unread } from "../../logic/hindrance";

export function Variables() {
    want("variables");
    const rows = tables.value.globals.filter(row => row.bank === 2);
    return (
        <div class="variables wide">
            {rows.map(row => (
                <div key={row.number} class={touched.value.has(keyOf(2, row.number)) ? "touched" : ""}>
                    <span>{row.number}</span>
                    <NumberField
                        value={globalValue(row) ?? ""}
                        hindrance={offline.value || unread(globalValue(row))}
                        low={row.low}
                        high={row.high}
                        label={`User variable ${row.number}`}
                        onCommit={value => send("SGP", row.number, 2, value).then(refresh)}
                    />
                    <IconButton
                        icon="save"
                        size={13}
                        title="Store (STGP)"
                        label={`Store variable ${row.number}`}
                        onClick={() => send("STGP", row.number, 2)}
                    />
                    <IconButton
                        icon="undo"
                        size={13}
                        title="Bring back what is stored (RSGP)"
                        label={`Restore variable ${row.number}`}
                        onClick={() => void send("RSGP", row.number, 2).then(refresh)}
                    />
                    <WhoWrote value={`gp[${row.number}]`} />
                </div>
            ))}
        </div>
    );
}

export function Coordinates() {
    want("coordinates");
    const { low, high } = axisParameter("target_position");
    const rows = Array.from({ length: tables.value.coordinates }, (_, n) => n);
    return (
        <table class="parameters coordinates">
            <thead>
                <tr>
                    <th>no.</th>
                    {[0, 1, 2].map(motor => (
                        <th key={motor} class={`motor motor${motor}`}>
                            motor {motor}
                        </th>
                    ))}
                    <th />
                </tr>
            </thead>
            <tbody>
                {rows.map(number => (
                    <tr key={number}>
                        <td class="no">{number}</td>
                        {[0, 1, 2].map(motor => {
                            const value = parameters.value.coordinates[number]?.[motor];
                            return (
                                <td
                                    key={motor}
                                    class={`cell ${touched.value.has(keyOf(COORDINATE_BANK, number, motor)) ? "touched" : ""}`}
                                >
                                    {value == null ? (
                                        <span class="muted">…</span>
                                    ) : (
                                        <NumberField
                                            value={value}
                                            low={low}
                                            high={high}
                                            label={`Coordinate ${number} of motor ${motor}`}
                                            onCommit={next => send("SCO", number, motor, next).then(refresh)}
                                        />
                                    )}
                                </td>
                            );
                        })}
                        <td class="acts wide">
                            <button
                                onClick={() => void send("CCO", number, 7).then(refresh)}
                                title="Take the actual positions of all motors (CCO)"
                            >
                                capture
                            </button>
                            <button
                                onClick={() => ask({ call: "go", coordinate: number, motors: [0, 1, 2] })}
                                {...unless(notReady.value, "Move all motors there (MVP COORD)")}
                            >
                                go
                            </button>
                            <WhoWroteOf
                                of={`coordinate ${number}`}
                                values={[0, 1, 2].map(motor => `co[${number}][${motor}]`)}
                            />
                        </td>
                    </tr>
                ))}
            </tbody>
        </table>
    );
}
