"""Many runs of one program, with values that change from run to run, and figures of each: see docs/sweeps.md.

`description` says what a sweep file means, `sources` holds the program with its constants, `plan` makes the rows,
`single` does the run of one row, `runner` all of them in processes, `table` keeps the results.
"""
