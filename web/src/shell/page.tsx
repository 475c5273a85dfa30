// The page: tool bar, files, editor, panels, and what lies over them.
import { online, welcome } from "../logic/app";
import { drawer, layout } from "../logic/layout";
import { past } from "../logic/past";
import { Files } from "../panels/files";
import { Confirmation, Overview, Palette } from "../panels/overlays";
import { PromptWindow } from "../panels/prompt";
import { Tour } from "../panels/tour";
import { Splitter } from "../widgets/basics";
import { Lane } from "./lane";
import { Main, Tabs } from "./main";
import { LowerPanel, RightPanels, columns, coversEditor, resize } from "./panels";
import { StatusBar } from "./status-bar";
import { TopBar } from "./top-bar";

export function Page() {
    const classes = [
        "shell",
        welcome.value && !online.value && "offline",
        drawer.value && "drawer",
        past.value && "past",
    ];
    return (
        <div class={classes.filter(Boolean).join(" ")} style={{ gridTemplateColumns: columns() }}>
            <TopBar />
            <Lane />
            <Side />
            <main class="middle">
                {!coversEditor() && (
                    <>
                        <Tabs />
                        <div class="work">
                            <Main />
                        </div>
                    </>
                )}
                <LowerPanel />
            </main>
            <RightPanels />
            <StatusBar />
            <div class="scrim" onPointerDown={() => (drawer.value = false)} />
            <Palette />
            <Overview />
            <Confirmation />
            <PromptWindow />
            <Tour />
        </div>
    );
}

function Side() {
    if (!layout.value.files && !drawer.value) return <div />;
    return (
        <div class="side">
            <Files />
            <Splitter
                vertical
                size={layout.value.filesWidth}
                label="Width of files"
                onDrag={delta => resize("filesWidth", delta, 120, 420)}
            />
        </div>
    );
}
