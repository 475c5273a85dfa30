// What the page does with each event of the server, and how it greets a new one.
import { batch } from "@preact/signals";
import { PROTOCOL } from "../wire";
import type { Welcome } from "../wire";
import {
    addTelegrams,
    connection,
    droppedTelegrams,
    eventListeners,
    files,
    forgetQuality,
    lastTelegram,
    link,
    listing,
    notify,
    online,
    progress,
    samples,
    sendWatches,
    tables,
    telegrams,
    watches,
    welcome,
    windows,
    world,
} from "./app";

connection.onEvent = event => {
    switch (event.event) {
        case "welcome":
            batch(() => welcomed(event));
            break;
        case "files_changed":
            files.value = event.files;
            break;
        case "loaded":
            listing.value = event.listing;
            break;
        case "windows":
            windows.value = event.count;
            break;
        case "progress":
            progress.value = event.done >= event.total ? null : event;
            break;
        case "telegrams":
            addTelegrams(event.lines);
            droppedTelegrams.value += event.dropped;
            break;
        case "happened":
            samples.mark({
                time: event.clock / tables.value.clock_hz,
                text: event.text,
                motor: event.motor,
                kind: event.kind,
            });
            break;
        case "world_changed":
            world.value = event.world;
            break;
        case "link":
            link.value = event;
            break;
        case "output":
            notify(event.severity, event.text);
            break;
        case "fault":
            notify("error", event.text);
            break;
    }
    for (const listener of eventListeners) listener(event);
};

const RENEWED = "tmcm34x.renewed";

/** The server speaks another protocol than this page: load its own, once. */
function renew(protocol: string): void {
    if (sessionStorage.getItem(RENEWED) === protocol) {
        notify("error", "This page does not fit its server: install tmcm34x again, or run `make web` in a checkout.");
        return;
    }
    sessionStorage.setItem(RENEWED, protocol);
    location.reload();
}

function welcomed(event: Welcome): void {
    if (event.protocol !== PROTOCOL) {
        renew(String(event.protocol));
        return;
    }
    sessionStorage.removeItem(RENEWED);
    const before = welcome.peek();
    welcome.value = event;
    listing.value = event.listing;
    if (before && (before.start !== event.start || before.seat !== event.seat)) {
        samples.clear();
        world.value = null;
        forgetQuality();
    }
    progress.value = null;
    lastTelegram.value = 0;
    telegrams.value = [];
    document.title = `${event.model.known ? event.model.name : "no module"} · tmcm34x`;
    sendRate();
    if (watches.value.length) sendWatches();
    void connection.call({ call: "list_files" }).then(list => (files.value = list));
    if (event.ability.bench) void connection.call({ call: "read_world" }).then(found => (world.value = found));
}

/** Enough for dials and plots to look alive, and cheap. */
const FRAMES_HZ = 20;
/** A window in the background asks for few frames. */
const sendRate = (): void =>
    void connection.call({ call: "set_rate", hz: document.hidden ? 2 : FRAMES_HZ }).catch(() => {});
document.addEventListener("visibilitychange", () => online.value && sendRate());
