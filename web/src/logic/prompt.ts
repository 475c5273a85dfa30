// A text that a person must type before something is done.
import { signal } from "@preact/signals";

export interface Prompt {
    title: string;
    label: string;
    initial: string;
    verb: string;
    settle: (text: string | null) => void;
}
export const prompt = signal<Prompt | null>(null);

/** What was typed, null for nothing. A prompt takes the place of one that is open. */
export function askText(title: string, label: string, initial: string, verb: string): Promise<string | null> {
    prompt.peek()?.settle(null);
    return new Promise(resolve => {
        prompt.value = {
            title,
            label,
            initial,
            verb,
            settle: text => {
                prompt.value = null;
                resolve(text?.trim() || null);
            },
        };
    });
}
