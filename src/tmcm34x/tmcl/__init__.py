"""The vocabulary of TMCL as firmware V4.36 speaks it: commands, parameters, status codes, datagrams.

Pure tables and codecs.  Everything else in the product reads them: the firmware dispatches by them, the
assembler and the language server parse and explain by them, the reference pages are printed from them.

Read in this order: `status`, `commands`, `axis_parameters`, `global_parameters`, `datagram`, `mnemonic`,
`telegrams`, `units`.
"""
