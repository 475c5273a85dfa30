// A question that a person must answer before something is done.
import { signal } from "@preact/signals";

export interface Answer {
    id: string;
    title: string;
    tone?: "primary" | "danger";
}
export interface Question {
    title: string;
    text: string;
    answers: Answer[];
    settle: (id: string | null) => void;
}
export const question = signal<Question | null>(null);

/** The id of the chosen answer, null for none. A question takes the place of one that is open. */
export function choose(title: string, text: string, answers: Answer[]): Promise<string | null> {
    question.peek()?.settle(null);
    return new Promise(resolve => {
        question.value = {
            title,
            text,
            answers,
            settle: id => {
                question.value = null;
                resolve(id);
            },
        };
    });
}

/** Whether something that cannot be undone is to be done. */
export const sure = async (text: string): Promise<boolean> =>
    (await choose("This cannot be undone", text, [{ id: "apply", title: "Apply", tone: "danger" }])) === "apply";
