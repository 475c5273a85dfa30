"""What a wrong line was meant to be: one message for one mistake, with the right text where there is only one.

`spelling` finds names near a misspelt one, `words` knows what other languages call things, `lines` repairs one line,
`files` what goes through several.  A repair is believed when the repaired line is a sound one; the assembler then
goes on with it, so that a mistake has no consequences.
"""
