"""The chips of the module, by part number.

Motion: `registers` (the map and its datagrams), `ramp` (the ramp generator in closed form), `tmc429` (the
chip, also as TMC428).  Drivers: `tmc246`.  Encoders of a TMCM-323: `tmc423`.
"""
