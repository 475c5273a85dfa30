// The window of `askText`.
import { prompt } from "../logic/prompt";
import { Modal } from "../widgets/basics";

export function PromptWindow() {
    const asked = prompt.value;
    if (!asked) return null;
    return (
        <Modal class="confirmation" label={asked.title} onClose={() => asked.settle(null)}>
            <form
                onSubmit={event => {
                    event.preventDefault();
                    asked.settle(String(new FormData(event.currentTarget).get("text") ?? ""));
                }}
            >
                <h2>{asked.title}</h2>
                <label class="prompt-field">
                    {asked.label}
                    <input name="text" defaultValue={asked.initial} spellcheck={false} autocomplete="off" autofocus />
                </label>
                <div class="row">
                    <span class="gap" />
                    <button type="button" onClick={() => asked.settle(null)}>
                        Cancel
                    </button>
                    <button type="submit" class="primary">
                        {asked.verb}
                    </button>
                </div>
            </form>
        </Modal>
    );
}
