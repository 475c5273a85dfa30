// What is shown while no page is open: where to begin, and the examples with their machines.
import { useEffect } from "preact/hooks";
import { perform } from "../logic/actions";
import { files, welcome } from "../logic/app";
import { newFile, openFile, openPage } from "../logic/documents";
import { openExample } from "../logic/examples";
import { examples, listExamples, place } from "../logic/modules";
import { beginTour } from "../logic/tour";
import { Icon } from "../widgets/icons";
import { connecting, offline, unless } from "../logic/hindrance";

const MOST = 8;

export function Start() {
    useEffect(() => void listExamples(), []);
    const list = examples.value;
    const title = new Map(list?.benches.map(bench => [bench.path, bench.title]));
    const own = files.value.filter(file => !file.folder && file.path.endsWith(".tmc"));
    return (
        <div class="page start">
            <div class="scroll" tabIndex={0} aria-label="Start">
                <h2>Start</h2>
                <div class="tiles">
                    <Tile
                        icon="plus"
                        title="New program"
                        text="An empty page; it is saved where you say."
                        run={() => newFile()}
                    />
                    <Tile
                        icon="plug"
                        title="Connect to a module…"
                        text={`Now: ${place.value}`}
                        run={() => openPage("connection")}
                    />
                    <Tile
                        icon="info"
                        title="Take the tour"
                        text="Six places of this page, in a minute."
                        run={beginTour}
                    />
                    <Tile
                        icon="search"
                        title="Find anything"
                        text="Files, commands and pages: Ctrl+P. All keys: F1."
                        run={() => perform("open")}
                    />
                </div>
                <div class="where">
                    <span class="muted">
                        Files are in <code>{welcome.value!.folder}</code>
                        {!welcome.value!.named && (
                            <>
                                {" "}
                                (<code>tmcm34x ide FOLDER</code> opens another folder)
                            </>
                        )}
                    </span>
                    {own.slice(0, MOST).map(file => (
                        <button key={file.path} class="link" onClick={() => openFile(file.path)}>
                            {file.path}
                        </button>
                    ))}
                    {own.length > MOST && <span class="muted">and {own.length - MOST} more at the left</span>}
                </div>
                <h3>Examples</h3>
                <p class="muted">
                    A click opens the program and puts its machine around the virtual module. Nothing is saved until you
                    save it.
                </p>
                <div class="gallery">
                    {list?.programs.map(example => (
                        <button
                            key={example.path}
                            class="tile"
                            {...unless(offline.value || connecting.value)}
                            onClick={() => openExample(example)}
                        >
                            <Icon name={example.bench ? "tools" : "play"} />
                            <b>{example.title}</b>
                            <span>{example.text}</span>
                            <small>{title.get(example.bench) ?? "bare motors"}</small>
                        </button>
                    ))}
                    {list && !list.programs.length && <p class="muted">This copy of tmcm34x came without examples.</p>}
                </div>
            </div>
        </div>
    );
}

const Tile = ({ icon, title, text, run }: { icon: string; title: string; text: string; run: () => unknown }) => (
    <button class="tile" onClick={run}>
        <Icon name={icon} />
        <b>{title}</b>
        <span>{text}</span>
    </button>
);
