"""What hangs on the connector: motors, loads, switches, encoders, signals, serial devices.

Pure models in physical units, which know no chip, board or firmware; `tmcm34x.bench` joins them to a board.
Rotor positions count 64ths of a full step, the finest microstep of the modules.
"""
