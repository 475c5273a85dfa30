"""Where the parameters live: what reading and writing each of them does.

The rows of `tmcl.axis_parameters` and `tmcl.global_parameters` say which numbers exist, their ranges and what is
stored.  The functions here add only what a row cannot say: the chip's register field behind a number, and what
else a new value brings about.  `axis` has the axis parameters, `bank_0` the global ones; `tables` puts rows and
functions together for one model and profile.
"""
