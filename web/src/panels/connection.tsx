// The connection page: which module the IDE works with, where others are, and how to get to them.
import { useSignal } from "@preact/signals";
import { useEffect } from "preact/hooks";
import { ask, can, files, link, reachable, welcome, windows } from "../logic/app";
import {
    connectTo,
    examples,
    far,
    found,
    isVirtual,
    listExamples,
    listPorts,
    place,
    ports,
    scan,
    scanned,
    scanning,
    trouble,
    underWay,
    useVirtual,
} from "../logic/modules";
import { Icon } from "../widgets/icons";
import { ByHand, Recent } from "./connection/by-hand";
import { Module, Scanning } from "./connection/scan";
import { IconButton } from "../widgets/basics";
import { connecting, unless } from "../logic/hindrance";

export function ConnectionPage() {
    useEffect(() => {
        void listPorts();
        void listExamples();
    }, []);
    return (
        <div class="page connection">
            <div class="scroll" tabIndex={0} aria-label="Connection">
                <h2>Connection</h2>
                <Now />
                <Trouble />
                <div class="halves">
                    <div>
                        <Serial />
                        <Recent />
                    </div>
                    <div>
                        <ByHand />
                        <Virtual />
                    </div>
                </div>
            </div>
        </div>
    );
}

/** The module that there is. */
function Now() {
    const model = welcome.value!.model;
    const name = model.known
        ? `${model.name}, firmware V${model.version.split("V")[1]}`
        : "unknown: it has not answered yet";
    return (
        <section class="card now" aria-label="Connected to">
            <i
                class={`heart ${reachable.value ? "open" : "lost"}`}
                role="img"
                aria-label={reachable.value ? "answers" : "does not answer"}
            />
            <div>
                <b>{place.value}</b>
                <p class="muted">
                    {name}
                    {!link.value.up && <> · {link.value.text}</>}
                    {windows.value > 1 && <> · {windows.value} windows work with it: all go along to another module</>}
                </p>
            </div>
            <span class="gap" />
            {!isVirtual.value && (
                <button {...unless(connecting.value)} onClick={() => useVirtual({})}>
                    Back to the virtual module
                </button>
            )}
        </section>
    );
}

/** What became of the last attempt. */
function Trouble() {
    if (underWay.value)
        return (
            <p class="attempt" role="status">
                Connecting to {underWay.value}…
            </p>
        );
    const { url, text, silent } = trouble.value ?? {};
    if (!text) return null;
    return (
        <div class="attempt bad" role="alert">
            <Icon name="alert" />
            <span>{text}</span>
            {silent && (
                <button
                    title="Connect all the same: the module is shown as soon as it replies"
                    onClick={() => connectTo(url!, true)}
                >
                    Wait for it
                </button>
            )}
            <IconButton icon="close" size={12} label="Dismiss" onClick={() => (trouble.value = null)} />
        </div>
    );
}

const ofPort = (device: string) => found.value.filter(row => row.url.startsWith(`serial:${device}?`));

function Serial() {
    const list = ports.value;
    const lines = list?.serial.map(port => `serial:${port.device}`) ?? [];
    if (list?.closed) return <p class="card muted">{list.closed}</p>;
    return (
        <section class="card" aria-label="Serial ports">
            <header>
                <h3>Serial ports</h3>
                <span class="gap" />
                <IconButton icon="refresh" label="Look for ports again" onClick={() => listPorts()} />
            </header>
            {list && !lines.length && (
                <p class="muted">This computer lists no serial ports. Another name can be typed below.</p>
            )}
            <ul class="ports">
                {list?.serial.map(({ device, description }) => {
                    const url = `serial:${device}`;
                    const modules = ofPort(device);
                    const looked = scanned.value?.ports.includes(url);
                    return (
                        <li key={device}>
                            <b class="mono">{device}</b> <span class="muted">{description}</span>
                            <span class="gap" />
                            <button
                                {...unless(scanning.value && "A scan is under way")}
                                onClick={() => scan([url], far.value)}
                            >
                                Scan
                            </button>
                            {modules.map(row => (
                                <Module key={row.url} row={row} />
                            ))}
                            {looked && !scanning.value && !modules.length && (
                                <p class="muted">
                                    {scanned.value!.complete ? "No module answered." : "Not scanned to the end."}
                                </p>
                            )}
                        </li>
                    );
                })}
            </ul>
            <Scanning lines={lines} />
        </section>
    );
}

const SHIPPED = "example:";

/** A virtual module, and the machine around it. */
function Virtual() {
    const model = useSignal(343);
    const bench = useSignal("");
    const keep = useSignal(true);
    const own = files.value.filter(file => !file.folder && file.path.endsWith(".toml"));
    const shipped = examples.value?.benches ?? [];
    const use = async () => {
        const name = bench.value;
        if (!name.startsWith(SHIPPED))
            return void useVirtual({ model: model.value as 343, bench: name, keep: keep.value });
        const text = await ask({ call: "read_example", path: name.slice(SHIPPED.length) });
        if (text !== null) void useVirtual({ bench: name.slice(SHIPPED.length), text, keep: keep.value });
    };
    return (
        <section class="card" aria-label="Virtual module">
            <h3>Virtual module</h3>
            <div class="fields">
                <label>
                    Machine
                    <select value={bench.value} onChange={event => (bench.value = event.currentTarget.value)}>
                        <option value="">Bare motors</option>
                        {own.length > 0 && (
                            <optgroup label="In this folder">
                                {own.map(({ path }) => (
                                    <option key={path} value={path}>
                                        {path}
                                    </option>
                                ))}
                            </optgroup>
                        )}
                        <optgroup label="Examples">
                            {shipped.map(({ path, title }) => (
                                <option key={path} value={SHIPPED + path}>
                                    {title}
                                </option>
                            ))}
                        </optgroup>
                    </select>
                </label>
                {!bench.value && (
                    <label class="narrow">
                        Model
                        <select
                            value={String(model.value)}
                            onChange={event => (model.value = Number(event.currentTarget.value))}
                        >
                            {[341, 342, 343].map(number => (
                                <option key={number} value={String(number)}>
                                    TMCM-{number}
                                </option>
                            ))}
                        </select>
                    </label>
                )}
            </div>
            <label class="check">
                <input
                    type="checkbox"
                    checked={keep.value}
                    onChange={event => (keep.value = event.currentTarget.checked)}
                />
                keep program and stored settings of the last virtual module of this model
            </label>
            <div class="row">
                <span class="gap muted small">
                    {can.value.bench ? "Switches, loads and faults are in the panel Bench." : ""}
                </span>
                <button class="primary" {...unless(connecting.value)} onClick={use}>
                    Use it
                </button>
            </div>
        </section>
    );
}
