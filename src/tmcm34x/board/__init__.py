"""The circuit boards: which chips sit on a TMCM-341, 342 or 343, how they are joined, and what the pins are.

Read `models` (one row a module), then `board`.
"""
