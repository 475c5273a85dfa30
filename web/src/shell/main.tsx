// The middle: tabs of files and pages, and the one that is in front.
import { connection, online, welcome } from "../logic/app";
import {
    PAGES,
    active,
    activeTab,
    closeTab,
    documents,
    newFile,
    opened,
    tabs,
    type PageName,
    type Tab,
} from "../logic/documents";
import { Editor } from "../editor/editor";
import { BenchBar } from "../panels/bench-bar";
import { Compare } from "../panels/compare";
import { ConnectionPage } from "../panels/connection";
import { Listing } from "../panels/listing";
import { Parameters } from "../panels/parameters";
import { Start } from "../panels/start";
import { Tools } from "../panels/tools";
import { Empty, IconButton, walk } from "../widgets/basics";
import { Icon } from "../widgets/icons";

const keyOf = (tab: Tab) => (tab.kind === "file" ? tab.path : `:${tab.kind}`);

export function Tabs() {
    return (
        <div class="tabs">
            <div class="tab-list" role="tablist" aria-label="Pages" onKeyDown={walk}>
                {tabs.value.map(tab => {
                    const key = keyOf(tab);
                    const document = documents.value.get(key);
                    const title = tab.kind === "file" ? tab.path.split("/").pop()! : PAGES[tab.kind];
                    return (
                        <div
                            key={key}
                            role="presentation"
                            class={`tab ${active.value === key ? "on" : ""}`}
                            onAuxClick={event => event.button === 1 && closeTab(key)}
                        >
                            <button
                                role="tab"
                                aria-selected={active.value === key}
                                tabIndex={active.value === key ? 0 : -1}
                                title={tab.path}
                                onClick={() => (active.value = key)}
                            >
                                {title}
                                {document?.dirty.value && <i class="dot" title="Not saved" />}
                                {document?.outside.value && <Icon name="alert" size={12} />}
                            </button>
                            <span class="close" title={`Close ${title} (Alt+W)`} onClick={() => closeTab(key)}>
                                <Icon name="close" size={11} />
                            </span>
                        </div>
                    );
                })}
            </div>
            <IconButton
                icon="plus"
                size={14}
                label="New program"
                title="New program (Alt+N)"
                onClick={() => newFile()}
            />
        </div>
    );
}

const MAIN: Partial<Record<PageName, () => preact.JSX.Element>> = {
    parameters: Parameters,
    tools: Tools,
    listing: Listing,
    compare: Compare,
    connection: ConnectionPage,
    start: Start,
};

export function Main() {
    if (!welcome.value)
        return (
            <Empty icon="plug" title={connection.state.value === "connecting" ? "Opening the IDE…" : "No server"}>
                {connection.state.value !== "connecting" && "This page comes to life when the IDE's server answers."}
            </Empty>
        );
    const kind = activeTab.value?.kind;
    const Page = kind && kind !== "file" ? MAIN[kind] : undefined;
    return (
        <>
            {Page && (
                <div class="guarded" inert={!online.value}>
                    <Page />
                </div>
            )}
            <div class="editors" hidden={kind !== "file"}>
                <BenchBar />
                <Editor />
            </div>
            {!activeTab.value && opened.value && <Start />}
        </>
    );
}
