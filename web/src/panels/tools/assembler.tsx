// How programs are assembled here, and what can be made of the one in front.
import { welcome } from "../../logic/app";
import { compare } from "../../logic/compare";
import { options } from "../../logic/options";
import { Switch } from "../../widgets/basics";
import { noProgram, unless } from "../../logic/hindrance";

const MODELS = [341, 342, 343];

export function Assembler() {
    const { model, append_stop } = options.value;
    const set = (part: Partial<typeof options.value>) => (options.value = { ...options.value, ...part });
    return (
        <div class="tool-body">
            <section class="card">
                <h3>Assembler</h3>
                <label>
                    Assembled for
                    <select
                        aria-label="Assembled for"
                        value={String(model)}
                        onChange={event => set({ model: Number(event.currentTarget.value) })}
                    >
                        <option value="0">the module at hand ({welcome.value!.model.name})</option>
                        {MODELS.map(number => (
                            <option key={number} value={String(number)}>
                                TMCM-{number}
                            </option>
                        ))}
                    </select>
                </label>
                <label>
                    Append STOP
                    <Switch on={append_stop} label="Append STOP" onChange={on => set({ append_stop: on })} />
                </label>
                <p class="muted note">
                    The model decides which parameters the linter accepts and what <code>#if MODEL == 342</code> takes.
                    A STOP is put behind the last instruction unless it is one, as the vendor's IDE does.
                </p>
            </section>
            <section class="card">
                <h3>The program on the screen</h3>
                <div class="row">
                    <button {...unless(noProgram.value)} onClick={() => compare("module")}>
                        Compare with the module
                    </button>
                    <button {...unless(noProgram.value)} onClick={() => compare("disk")}>
                        Compare with its file
                    </button>
                </div>
            </section>
        </div>
    );
}
