"""Recorders: what a bench does, as a table, as waveforms, as a picture, in figures.

A `Trace` is a rig with recorders around it, and a `Part` like the rig: it lets each of them look before and after
every event.  Slicing does not matter to a rig, so recording changes nothing in it.

`recorder`  what all of them are
`table`     CSV: a row for each motor every few milliseconds
`waveform`  VCD: step, direction, enable, switches, inputs, outputs and program counter, for GTKWave or Surfer
`picture`   SVG, or PNG with the extra `plot`: position and speed over time, and what the program did
`figures`   distance, peak speed and final position of each motor
"""
