// A line by hand, and the lines that were connected to before.
import { connectTo, far, found, ports, recent, scan, scanned, scanning } from "../../logic/modules";
import { remembered } from "../../logic/settings";
import { Module } from "./scan";
import { IconButton } from "../../widgets/basics";
import { connecting, unless } from "../../logic/hindrance";

const BAUDS = [9600, 14400, 19200, 28800, 38400, 57600, 76800, 115200];

type Kind = "serial" | "tcp" | "can" | "slcan";
const KINDS: [Kind, string][] = [
    ["serial", "Serial port"],
    ["tcp", "TCP"],
    ["can", "CAN"],
    ["slcan", "SLCAN adapter"],
];
const form = remembered("connection-form", {
    kind: "serial" as Kind,
    device: "",
    baud: "9600",
    address: "1",
    host: "127.0.0.1:17000",
    interface: "socketcan",
    channel: "can0",
    adapter: "",
    id: "1",
    reply: "2",
    bitrate: "1000000",
});

/** Where to look for modules: all of the line but the address, and of a serial port the rate. */
const lineOf = (now: typeof form.value): string => {
    if (now.kind === "serial") return `serial:${now.device}`;
    if (now.kind === "tcp") return `tcp:${now.host}`;
    return urlOf(now).replace(/id=[^&]*&/, "");
};

const urlOf = (now: typeof form.value): string => {
    const ids = `?id=${now.id}&reply=${now.reply}&bitrate=${now.bitrate}`;
    if (now.kind === "serial") return `serial:${now.device}?baud=${now.baud}&address=${now.address}`;
    if (now.kind === "tcp") return `tcp:${now.host}?address=${now.address}`;
    return now.kind === "can" ? `can:${now.interface}:${now.channel}${ids}` : `slcan:${now.adapter}${ids}`;
};

/** A line by hand. */
export function ByHand() {
    const now = form.value;
    const field = (name: keyof typeof now, title: string, options: { list?: string[]; narrow?: boolean } = {}) => (
        <label class={options.narrow ? "narrow" : ""}>
            {title}
            <input
                value={now[name]}
                list={options.list && `list-${name}`}
                spellcheck={false}
                autocapitalize="off"
                onInput={event => (form.value = { ...form.value, [name]: event.currentTarget.value.trim() })}
            />
            {options.list && (
                <datalist id={`list-${name}`}>
                    {options.list.map(text => (
                        <option key={text} value={text} />
                    ))}
                </datalist>
            )}
        </label>
    );
    const narrow = true;
    const onBus = [
        field("id", "Module id", { narrow }),
        field("reply", "Reply id", { narrow }),
        field("bitrate", "Bits per second", { list: ["1000000", "500000", "250000", "125000"], narrow }),
    ];
    const line = lineOf(now);
    const noCan = now.kind !== "serial" && now.kind !== "tcp" && ports.value && !ports.value.can.length;
    const devices = ports.value?.serial.map(port => port.device) ?? [];
    return (
        <form
            class="card"
            aria-label="Connect by hand"
            onSubmit={event => {
                event.preventDefault();
                void connectTo(urlOf(form.value));
            }}
        >
            <h3>Connect</h3>
            <div class="choice" role="radiogroup" aria-label="Kind of line">
                {KINDS.map(([kind, title]) => (
                    <button
                        key={kind}
                        type="button"
                        role="radio"
                        aria-checked={now.kind === kind}
                        class={now.kind === kind ? "on" : ""}
                        onClick={() => (form.value = { ...form.value, kind })}
                    >
                        {title}
                    </button>
                ))}
            </div>
            <div class="fields">
                {now.kind === "serial" && [
                    field("device", "Port", { list: devices }),
                    field("baud", "Bits per second", { list: BAUDS.map(String), narrow }),
                    field("address", "Address", { narrow }),
                ]}
                {now.kind === "tcp" && [field("host", "HOST:PORT"), field("address", "Address", { narrow })]}
                {now.kind === "can" && [
                    field("interface", "Interface", { list: ports.value?.can ?? [] }),
                    field("channel", "Channel"),
                    ...onBus,
                ]}
                {now.kind === "slcan" && [field("adapter", "Port of the adapter", { list: devices }), ...onBus]}
            </div>
            {noCan && (
                <p class="muted">
                    python-can is missing on the server: install tmcm34x with its extra <code>can</code>.
                </p>
            )}
            {found.value
                .filter(row => row.url.startsWith(line.split("?")[0]!))
                .map(row => (
                    <Module key={row.url} row={row} />
                ))}
            {scanned.value?.ports.includes(line) && !scanning.value && !found.value.length && (
                <p class="muted">{scanned.value.complete ? "No module answered." : "Not scanned to the end."}</p>
            )}
            <div class="row">
                <code class="gap">{urlOf(now)}</code>
                <button
                    type="button"
                    {...unless(
                        ports.value?.closed || (scanning.value && "A scan is under way"),
                        "Ask all addresses on this line for their version",
                    )}
                    onClick={() => scan([line], far.value)}
                >
                    Scan
                </button>
                <button class="primary" {...unless(ports.value?.closed || connecting.value)}>
                    Connect
                </button>
            </div>
        </form>
    );
}

export function Recent() {
    if (!recent.value.length) return null;
    return (
        <section class="card" aria-label="Recent connections">
            <h3>Recent</h3>
            <ul class="ports">
                {recent.value.map(url => (
                    <li key={url}>
                        <code>{url}</code>
                        <IconButton
                            icon="close"
                            size={12}
                            label={`Remove ${url}`}
                            onClick={() => (recent.value = recent.value.filter(other => other !== url))}
                        />
                        <button {...unless(connecting.value)} onClick={() => connectTo(url)}>
                            Connect
                        </button>
                    </li>
                ))}
            </ul>
        </section>
    );
}
