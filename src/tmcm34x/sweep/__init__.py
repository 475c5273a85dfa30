"""Many runs of one program, with values that change from run to run, and figures of each: see docs/sweeps.md.

    from tmcm34x import sweep

    job = sweep.load("xy-stage.toml")
    for outcome in sweep.run(job):
        print(outcome.values, outcome.figures)

`description` says what a sweep file means, `sources` holds the program with its constants, `plan` makes the rows,
`single` does the run of one row, `work` shares rows out, `runner` and `cluster` have them done in processes or on other
machines, `table` keeps the results, `outcomes` is the face of all that.
"""

from tmcm34x.sweep.description import SweepError
from tmcm34x.sweep.loading import load
from tmcm34x.sweep.outcomes import Outcome, run, run_row
from tmcm34x.sweep.pareto import front
from tmcm34x.sweep.plan import Job

__all__ = ["Job", "Outcome", "SweepError", "front", "load", "run", "run_row"]
