// Numbers as people type them, and finding things by a few letters.

/** Decimal, `$` hexadecimal or `%` binary, as in TMCL; null when it is none. */
export function readNumber(text: string): number | null {
    const plain = text.replace(/\u2212/g, "-").replace(/[\u2009 ]/g, "");
    const special = /^([+-]?)(?:\$([0-9a-f]+)|%([01]+))$/i.exec(plain);
    if (special) {
        const size = special[2] ? parseInt(special[2], 16) : parseInt(special[3]!, 2);
        return special[1] === "-" ? -size : size;
    }
    return /^[+-]?(\d+\.?\d*|\.\d+)$/.test(plain) ? Number(plain) : null;
}

/** Words that must all occur; a word with a leading minus must not. */
export function matches(text: string, words: readonly string[]): boolean {
    const low = text.toLowerCase();
    return words.every((word) => (word.length > 1 && word.startsWith("-") ? !low.includes(word.slice(1)) : low.includes(word)));
}

/** How well `text` matches `wish`: letters in order; 0 is not at all, more is better. */
export function score(text: string, wish: string): number {
    if (!wish) return 1;
    const low = text.toLowerCase();
    const at = low.indexOf(wish);
    if (at >= 0) return 100 - at + (at === 0 || low[at - 1] === " " ? 50 : 0);
    let place = 0;
    for (const letter of wish) {
        place = low.indexOf(letter, place) + 1;
        if (!place) return 0;
    }
    return 10;
}
