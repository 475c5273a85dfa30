"""From source text to instructions and back, with everything that an editor needs.

    from tmcm34x.toolchain.assembler import assemble
    assembly = assemble("ROR 0, 500")
    assembly.program        the instructions
    assembly.source_map     where each of them stands in the source
    assembly.diagnostics    what is wrong, all of it

Pure: no files, no clock; included files come through a function of the caller's.  Nothing that a user writes
raises an exception.

Read in this order: `diagnostics`, `tokens`, `expressions`, `parser`; `assembler` with `first_pass`, `second_pass`,
`names` and `messages`, and what they make, `assembly`; `mending` and `structure`; then `image`, `disassembler`,
`formatter`, `listing`; `flow`, `linter` and `map`; `reference` and `explanations` for the manual.
"""
