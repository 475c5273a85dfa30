// All telegrams of all links, decoded.
import { useComputed, useSignal, useSignalEffect } from "@preact/signals";
import { useEffect, useRef } from "preact/hooks";
import { ask, can, connection, droppedTelegrams, lastTelegram, online, tables, telegrams } from "../logic/app";
import { remembered } from "../logic/settings";
import { matches } from "../logic/text";
import { Empty, IconButton, offer } from "../widgets/basics";
import { Icon } from "../widgets/icons";

const filter = remembered("log-filter", "");
const following = remembered("log-follow", true);
const polls = remembered("log-polls", false);
const ROW = 19;

const millis = (seconds: number): string => (seconds * 1000).toFixed(seconds < 1 ? 2 : 0);

export function Log() {
    useEffect(() => {
        if (!online.value) return;
        void ask({ call: "follow_log", on: true, polls: polls.value, since: lastTelegram.value });
        return () => void connection.call({ call: "follow_log", on: false }).catch(() => {});
    }, [online.value, polls.value]);
    const box = useRef<HTMLDivElement>(null);
    const top = useSignal(0);
    const shown = useComputed(() => {
        const words = filter.value.toLowerCase().split(/\s+/).filter(Boolean);
        return words.length
            ? telegrams.value.filter(line => matches(`${line.link} ${line.direction} ${line.data} ${line.text}`, words))
            : telegrams.value;
    });
    useSignalEffect(() => {
        void shown.value.length;
        if (following.value && box.current)
            requestAnimationFrame(() => box.current && (box.current.scrollTop = box.current.scrollHeight));
    });
    const hz = tables.value.clock_hz;
    const chosen = useSignal(0);
    const paired = useComputed(() => {
        const line = telegrams.value.find(other => other.number === chosen.value);
        return line ? line.request || line.number : 0;
    });
    const walkLines = (event: KeyboardEvent) => {
        const step = { ArrowUp: -1, ArrowDown: 1 }[event.key];
        if (!step) return;
        event.preventDefault();
        const at = shown.value.findIndex(line => line.number === chosen.value);
        const next = Math.max(0, Math.min(shown.value.length - 1, at < 0 ? shown.value.length - 1 : at + step));
        chosen.value = shown.value[next]?.number ?? 0;
        const { scrollTop, clientHeight } = box.current!;
        if (next * ROW < scrollTop) box.current!.scrollTop = next * ROW;
        else if ((next + 1) * ROW > scrollTop + clientHeight) box.current!.scrollTop = (next + 1) * ROW - clientHeight;
    };
    const first = Math.max(0, Math.floor(top.value / ROW) - 5);
    const last = Math.min(shown.value.length, Math.ceil((top.value + window.innerHeight) / ROW));
    const text = () =>
        `${shown.value
            .map(line =>
                [
                    (line.clock / hz).toFixed(6),
                    line.link,
                    line.direction === "in" ? ">" : "<",
                    line.data,
                    line.request ? millis(line.latency / hz) : "",
                    line.text,
                ].join("\t"),
            )
            .join("\n")}\n`;
    return (
        <div class="log">
            <div class="bar">
                <label class="search">
                    <Icon name="filter" />
                    <input
                        placeholder="filter: words, -without"
                        aria-label="Filter telegrams"
                        value={filter.value}
                        onInput={event => (filter.value = event.currentTarget.value)}
                    />
                </label>
                <span class="muted">
                    {shown.value.length}
                    {filter.value && ` of ${telegrams.value.length}`} telegrams
                    {droppedTelegrams.value ? `, ${droppedTelegrams.value} too many to keep` : ""}
                </span>
                {!can.value.peek && (
                    <label class="check" title="The IDE reads positions and states all the time">
                        <input
                            type="checkbox"
                            checked={polls.value}
                            onChange={event => (polls.value = event.currentTarget.checked)}
                        />{" "}
                        with the IDE's polling
                    </label>
                )}
                <span class="gap" />
                <IconButton
                    icon="down"
                    pressed={following.value}
                    label="Stay at the newest line"
                    onClick={() => (following.value = !following.value)}
                />
                <IconButton icon="save" label="Save the lines shown" onClick={() => offer("telegrams.txt", text())} />
                <IconButton
                    icon="trash"
                    label="Clear the log"
                    onClick={() => {
                        telegrams.value = [];
                        droppedTelegrams.value = 0;
                    }}
                />
            </div>
            {shown.value.length ? (
                <div
                    class="lines"
                    ref={box}
                    role="log"
                    aria-label="Telegrams"
                    tabIndex={0}
                    onKeyDown={walkLines}
                    onScroll={event => (top.value = event.currentTarget.scrollTop)}
                >
                    <div style={{ height: `${shown.value.length * ROW}px`, position: "relative" }}>
                        {shown.value.slice(first, last).map((line, n) => (
                            <div
                                key={line.number}
                                class={`telegram ${line.direction} ${line.status && line.status < 100 ? "bad" : ""} ${line.number === chosen.value ? "chosen" : ""} ${paired.value && (line.request || line.number) === paired.value ? "pair" : ""}`}
                                onClick={() => (chosen.value = line.number)}
                                style={{ top: `${(first + n) * ROW}px` }}
                            >
                                <span class="when">{(line.clock / hz).toFixed(6)}</span>
                                <span class="link-name" title={line.link}>
                                    {line.link}
                                </span>
                                <span class="arrow">{line.direction === "in" ? "→" : "←"}</span>
                                <span class="bytes">{line.data}</span>
                                <span
                                    class="latency"
                                    title={
                                        line.request ? `Reply to telegram ${line.request}, so long after it` : undefined
                                    }
                                >
                                    {line.request ? `${millis(line.latency / hz)} ms` : ""}
                                </span>
                                <span class="text">
                                    {line.number !== chosen.value
                                        ? ""
                                        : line.request
                                          ? `to ${line.request}: `
                                          : `${line.number}: `}
                                    {line.text}
                                </span>
                            </div>
                        ))}
                    </div>
                </div>
            ) : telegrams.value.length ? (
                <Empty icon="filter" title="No line has all these words" />
            ) : (
                <Empty icon="list" title="Quiet lines">
                    Telegrams of every link appear here: of this IDE's direct mode, and of other hosts.
                </Empty>
            )}
        </div>
    );
}
