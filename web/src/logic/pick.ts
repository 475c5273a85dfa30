// Files of the person's computer.

/** Let a person choose a file of these kinds. */
export function pickFile(accept: string, take: (file: File) => unknown): void {
    const field = document.createElement("input");
    field.type = "file";
    field.accept = accept;
    field.onchange = () => field.files?.[0] && void take(field.files[0]);
    field.click();
}

/** The bytes of a file for the server, which knows the encodings of texts. */
export const base64 = (file: Blob): Promise<string> =>
    new Promise((take, fail) => {
        const reader = new FileReader();
        reader.onload = () => take((reader.result as string).replace(/^[^,]*,/, ""));
        reader.onerror = () => fail(reader.error!);
        reader.readAsDataURL(file);
    });
