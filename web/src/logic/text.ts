// Numbers as people type them, and finding things by a few letters.

/** How much one of a unit is, by the words for it in lower case. */
export type Units = Readonly<Record<string, number>>;

const GROUPS = /^\d{1,3}(?:([ \u2009\u00a0\u202f'_])\d{3})(?:\1\d{3})*$/;
const MANY_GROUPS = /^[1-9]\d{0,2}(?:([.,])\d{3})(?:\1\d{3})+$/;
/** One group behind a comma or a dot: a thousand to some, a fraction to others. */
const AMBIGUOUS = /^[1-9]\d{0,2},\d{3}$/;

/** Decimal with a dot or a comma, digits in groups or not, `$` hexadecimal or `%` binary as in TMCL; perhaps with a unit.
 * Null when it is none, or could be two. */
export function readNumber(text: string, units: Units = {}): number | null {
    const plain = text.trim().replace(/^\u2212/, "-");
    const special = /^([+-]?)(?:\$([0-9a-f]+)|%([01]+))$/i.exec(plain);
    if (special) {
        const size = special[2] ? parseInt(special[2], 16) : parseInt(special[3]!, 2);
        return special[1] === "-" ? -size : size;
    }
    const parts = /^([+-]?)\s*([\d.,'_ \u2009\u00a0\u202f]*\d[.,]?)\s*(\D*)$/.exec(plain);
    if (!parts) return null;
    const unit = parts[3]!.trim().toLowerCase();
    const factor = unit ? units[unit] : 1;
    const size = readDigits(parts[2]!);
    if (size === null || factor === undefined) return null;
    const value = unit ? Math.round(size * factor) : size;
    return parts[1] === "-" ? -value : value;
}

function readDigits(text: string): number | null {
    if (GROUPS.test(text) || MANY_GROUPS.test(text)) return Number(text.replace(/\D/g, ""));
    if (AMBIGUOUS.test(text)) return null;
    return /^(\d+[.,]?\d*|[.,]\d+)$/.test(text) ? Number(text.replace(",", ".")) : null;
}

/** Words that must all occur; a word with a leading minus must not. */
export function matches(text: string, words: readonly string[]): boolean {
    const low = text.toLowerCase();
    return words.every(word =>
        word.length > 1 && word.startsWith("-") ? !low.includes(word.slice(1)) : low.includes(word),
    );
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
