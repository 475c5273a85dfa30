// Files of the person's computer.

/** Let a person choose a file of these kinds. */
export function pickFile(accept: string, take: (file: File) => unknown): void {
    const field = document.createElement("input");
    field.type = "file";
    field.accept = accept;
    field.onchange = () => field.files?.[0] && void take(field.files[0]);
    field.click();
}
