// The example gallery: a program, what it includes and the machine it is for, opened by one click.
import type { ExampleShape } from "../wire";
import { ask, connection, files } from "./app";
import { openFile, openText } from "./documents";
import { useVirtual } from "./modules";

/** Where an example is kept: beside the program itself when the opened folder holds it, else in a folder of its own. */
async function placeFor(path: string, text: string): Promise<string> {
    if (files.value.some(file => file.path === path)) {
        const there = await connection.call({ call: "read_file", path }).catch(() => null);
        if (there?.text === text) return path;
    }
    return `examples/${path}`;
}

async function show(path: string): Promise<{ path: string; text: string } | null> {
    const text = await ask({ call: "read_example", path });
    if (text === null) return null;
    const at = await placeFor(path, text);
    await openText(at, text);
    return { path: at, text };
}

export async function openExample(example: ExampleShape): Promise<void> {
    const bench = example.bench ? await show(example.bench) : null;
    for (const name of example.includes) await show(name);
    const program = await show(example.path);
    if (!program) return;
    await openFile(program.path);
    await useVirtual({ model: 343, bench: bench?.path ?? "", text: bench?.text ?? "", keep: false });
}
