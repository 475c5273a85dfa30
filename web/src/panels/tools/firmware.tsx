// What the module says of itself, and its factory settings.
import { useSignal } from "@preact/signals";
import { useEffect, useRef } from "preact/hooks";
import { execute, link, notify, welcome } from "../../logic/app";
import { refresh } from "../../logic/parameters";
import { offline, unless } from "../../logic/hindrance";

export function Firmware() {
    const binary = useSignal<number | null>(null);
    const asked = useRef(false);
    useEffect(() => {
        if (asked.current) return;
        asked.current = true;
        void execute({ number: 136, type: 1 }).then(
            exchange => (binary.value = exchange?.status === 100 ? exchange.value : null),
        );
    }, []);
    const model = welcome.value!.model;
    const value = binary.value;
    const reset = async () => {
        if (!(await execute({ number: 137, value: 1234 }))) return;
        notify(
            "information",
            "Command 137 was sent, which is never answered. The module restarts with its factory settings; the program in it is kept.",
        );
        await refresh();
    };
    return (
        <div class="tool-body columns">
            <section class="card">
                <h3>Firmware</h3>
                <dl>
                    <div>
                        <dt>module</dt>
                        <dd>{model.known ? model.name : "unknown"}</dd>
                    </div>
                    <div>
                        <dt>version</dt>
                        <dd>{model.known ? model.version : "unknown"}</dd>
                    </div>
                    <div>
                        <dt>as the module reports</dt>
                        <dd>{value === null ? "no answer" : `${value >> 16} V${(value >> 8) & 255}.${value & 255}`}</dd>
                    </div>
                    <div>
                        <dt>where</dt>
                        <dd>
                            {welcome.value!.source}: {link.value.place}
                        </dd>
                    </div>
                    <div>
                        <dt>largest current</dt>
                        <dd>
                            {!model.known
                                ? "unknown"
                                : model.max_current_ma
                                  ? `${model.max_current_ma} mA`
                                  : model.drivers
                                    ? "depends on the board"
                                    : "set at the driver"}
                        </dd>
                    </div>
                    <div>
                        <dt>IDE</dt>
                        <dd>{welcome.value!.product}</dd>
                    </div>
                </dl>
            </section>
            <section class="card danger">
                <h3>Factory settings</h3>
                <p>
                    All stored axis and global parameters go back to their defaults, addresses and baud rate too. The
                    module restarts; the program in it stays.
                </p>
                <button class="danger" {...unless(offline.value)} onClick={reset}>
                    Restore factory settings…
                </button>
            </section>
        </div>
    );
}
