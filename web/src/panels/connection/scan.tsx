// What a scan found, and how far it is.
import { connectTo, far, scan, scanning, stopScan, unseen } from "../../logic/modules";
import type { ScanFound } from "../../wire";
import { connecting, unless } from "../../logic/hindrance";

export const Module = ({ row }: { row: ScanFound }) => (
    <div class="module">
        <b>
            TMCM-{row.model} {row.version}
        </b>
        <span class="mono">{row.place}</span>
        <button type="button" class="primary" {...unless(connecting.value)} onClick={() => connectTo(row.url)}>
            Connect
        </button>
    </div>
);

/** How far a scan is, and what it does. */
export function Scanning({ lines }: { lines: string[] }) {
    const now = scanning.value;
    return (
        <>
            {now ? (
                <div class="row" role="status">
                    <progress max={now.total || 1} value={now.done} aria-label="Scan" />
                    <span class="mono">{now.place}</span>
                    <button onClick={stopScan}>Stop the scan</button>
                </div>
            ) : (
                <div class="row">
                    {lines.length > 1 && <button onClick={() => scan(lines, far.value)}>Scan all</button>}
                    <label class="check">
                        <input
                            type="checkbox"
                            checked={far.value}
                            onChange={event => (far.value = event.currentTarget.checked)}
                        />
                        all addresses 1 to 255, not only 1 to 16
                    </label>
                </div>
            )}
            {unseen.value.map(text => (
                <p key={text} class="bad">
                    {text}
                </p>
            ))}
            <p class="muted small">
                A scan opens the ports and asks for the version (command 136) at every bit rate; it changes nothing in a
                module. Other devices on these ports receive the question too.
            </p>
        </>
    );
}
