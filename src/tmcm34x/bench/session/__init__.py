"""Sessions: conversations with a module as text (docs/sessions.md), read, played and judged.

`phrase`      lines of fixed words and slots, with errors that name the column
`world`       what happens to a module (`!`) and what can be measured on it (`?`)
`condition`   what must hold within a time, always or never
`actions`     what one line of a session does
`language`    from text to cases
`player`      one conversation under way
`wires`       the line to a virtual module;  `real` the line to a real one
`runner`      cases on all their models and links, and what came of them
`junit`       results for CI servers
`watch`       the expectations of a bench file
"""
