// Values whose changes hold the program: their list, and the form for one more.
import { addDataBreakpoint, dataBreakpoints, setDataBreakpoints, type DataBreakpoint } from "../logic/debugger";
import { offline, unless } from "../logic/hindrance";
import { IconButton } from "../widgets/basics";

const FIELDS = [
    ["value", "New data breakpoint", "at changes of gp[3], ap[1][0] passes 20000"],
    ["condition", "Only if", "only if x > 5"],
    ["hits", "From which change on", "hits 5, == 3, % 10"],
] as const;

async function add(form: HTMLFormElement): Promise<void> {
    const data = new FormData(form);
    const text = (name: string) => String(data.get(name)).trim();
    const item = { value: text("value"), condition: text("condition"), hits: text("hits"), fault: "" };
    if (item.value && (await addDataBreakpoint(item))) form.reset();
}

export function DataBreakpoints() {
    return (
        <>
            <ul class="breakpoint-list">
                {dataBreakpoints.value.map(item => (
                    <Row key={item.value} item={item} />
                ))}
            </ul>
            <form
                class="data-breakpoint"
                onSubmit={event => {
                    event.preventDefault();
                    void add(event.currentTarget);
                }}
            >
                {FIELDS.map(([name, label, example]) => (
                    <input
                        key={name}
                        name={name}
                        aria-label={label}
                        title={label}
                        placeholder={example}
                        spellcheck={false}
                    />
                ))}
                <button {...unless(offline.value, "Hold the program when this value changes")}>Add</button>
            </form>
        </>
    );
}

function Row({ item }: { item: DataBreakpoint }) {
    const { value, condition, hits, fault } = item;
    const texts = [condition && `if ${condition}`, hits && `hits ${hits}`, fault].filter(Boolean).join(", ");
    return (
        <li>
            <span class={`breakpoint data ${fault ? "unverified" : ""}`} />
            <span>{value}</span>
            <span class="muted" title={texts}>
                {texts}
            </span>
            <IconButton
                icon="close"
                size={12}
                label={`Remove data breakpoint ${value}`}
                onClick={() => setDataBreakpoints(dataBreakpoints.value.filter(other => other !== item))}
            />
        </li>
    );
}
