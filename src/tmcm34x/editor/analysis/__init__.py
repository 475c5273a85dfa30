"""What an editor asks about a program: hover texts, completions, references, hints, fixes.

Pure: no protocol, no files, no event loop.  `program.Analysis` is one program with all that is known about it; the
functions of the other modules answer questions about it.  The language server turns the answers into messages.
"""
