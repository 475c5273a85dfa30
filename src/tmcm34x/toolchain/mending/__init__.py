"""What a wrong line was meant to be: one message for one mistake, with the right text where there is only one.

`spelling` finds names near a misspelt one, `words` lists what other languages call things; `lines` repairs one line by
the kinds of repairs in `vocabulary`, `definitions` and `punctuation`; `files` repairs what goes through several.
A repair is believed when the repaired line is a sound one (`soundness`); the assembler then goes on with it, so that a
mistake has no consequences.
"""
