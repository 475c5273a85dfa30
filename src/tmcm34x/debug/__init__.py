"""Debugging stand-alone programs: run control, and the Debug Adapter Protocol.

Read in this order: `expressions`, `view` (names and values), `control` (breakpoints), `session` (run control in
this process), `remote` (what a module at the end of a line allows), `sources` and `debuggee`,
`breakpoints` and `inspection` (requests of the protocol by subject), `dap`.
"""
