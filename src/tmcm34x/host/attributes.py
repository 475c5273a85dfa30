"""The parameters of chapters 7 and 8 as attributes.  Written by docs/generate.py from the tables: do not edit."""

from tmcm34x.host.parameters import Readable, Writable


class AxisAttributes:
    """The axis parameters, by their keys."""

    __slots__ = ()

    target_position = Writable("target_position")
    """Where the motor goes in position mode. -8388608..8388607 [microsteps], parameter 0."""
    actual_position = Writable("actual_position")
    """Where the motor is; write it only to set a reference point, together with parameter 0.
    -8388608..8388607 [microsteps], parameter 1."""
    target_speed = Writable("target_speed")
    """The target speed in velocity mode; in position mode the chip's: maximum while speeding up or
    cruising, 0 while braking and at rest. -2047..2047 [velocity units], parameter 2."""
    actual_speed = Writable("actual_speed")
    """The speed the motor has now. -2047..2047 [velocity units], parameter 3."""
    max_speed = Writable("max_speed")
    """Top speed of positioning moves; choose the pulse divisor (154) so that it is neither tiny nor at the
    limit. 0..2047 [velocity units], parameter 4."""
    max_acceleration = Writable("max_acceleration")
    """Acceleration and deceleration; a change also recomputes the chip's braking factors. 0..2047
    [acceleration units], parameter 5."""
    max_current = Writable("max_current")
    """Coil current while the motor moves. Too much of it destroys motors. 0..255 [1/255 of the module's
    maximum], parameter 6. Only TMCM-341 and 343."""
    standby_current = Writable("standby_current")
    """Coil current at rest, after the power down delay (214). 0..255 [1/255 of the module's maximum],
    parameter 7. Only TMCM-341 and 343."""
    position_reached = Readable("position_reached")
    """1 when the actual position equals the target position. 0..1, parameter 8."""
    reference_switch = Readable("reference_switch")
    """1 when the reference switch is active; it shares the line of the left stop switch. 0..1, parameter
    9."""
    right_switch = Readable("right_switch")
    """1 when the right switch is active. 0..1, parameter 10."""
    left_switch = Readable("left_switch")
    """1 when the left switch is active. 0..1, parameter 11."""
    right_switch_disable = Writable("right_switch_disable")
    """1: the right switch does not stop the motor. 0..1, parameter 12."""
    left_switch_disable = Writable("left_switch_disable")
    """1: the left switch does not stop the motor. 0..1, parameter 13."""
    min_speed = Writable("min_speed")
    """Speed of the last steps of a move; leave it at 1, or the target may be missed. 0..2047 [velocity
    units], parameter 130."""
    actual_acceleration = Readable("actual_acceleration")
    """The acceleration at this moment, without sign. 0..2047 [acceleration units], parameter 135."""
    ramp_mode = Writable("ramp_mode")
    """How the chip makes its ramp; ROR, ROL, MST and MVP set it themselves. 0..2, parameter 138."""
    microstep_resolution = Writable("microstep_resolution")
    """Microsteps of a full step; speed and distance in full steps change with it. A TMCM-342 keeps it
    without effect on its step outputs. 0..6, parameter 140."""
    soft_stop = Writable("soft_stop")
    """What a stop switch does: 0 stops at once, 1 along the ramp. 0..1, parameter 149."""
    ramp_divisor = Writable("ramp_divisor")
    """Divides the clock of the ramp generator; a step of one halves or doubles the acceleration. 0..13
    [power of two], parameter 153."""
    pulse_divisor = Writable("pulse_divisor")
    """Divides the clock of the pulse generator; a step of one halves or doubles speed and acceleration.
    0..13 [power of two], parameter 154."""
    reference_mode = Writable("reference_mode")
    """Which switches RFS looks for. 1..3, parameter 193."""
    reference_search_speed = Writable("reference_search_speed")
    """Speed of RFS until the switch is found; 0 takes the maximum positioning speed (4). 0..2047 [velocity
    units], parameter 194."""
    reference_switch_speed = Writable("reference_switch_speed")
    """Speed of RFS while it measures the switching points; 0 takes a quarter of parameter 4. 0..2047
    [velocity units], parameter 195."""
    end_switch_distance = Readable("end_switch_distance")
    """Way between the two end switches, measured by RFS in modes 2 and 3. 0..8388607 [microsteps],
    parameter 196."""
    mixed_decay_threshold = Writable("mixed_decay_threshold")
    """Speed above which the drivers use mixed decay; -1 always and in every part of the wave. -1..2048
    [velocity units], parameter 203. Only TMCM-341 and 343."""
    freewheeling = Writable("freewheeling")
    """Time at rest after which the coils are switched off; 0 never. 0..65535 [10 ms], parameter 204. Only
    TMCM-341 and 343."""
    stall_threshold = Writable("stall_threshold")
    """Load value at which the motor is stopped as stalled; 0 switches the detection off. 0..7, parameter
    205. Only TMCM-341 and 343."""
    load_value = Readable("load_value")
    """Load as the driver measures it, greater for more load. 0..7, parameter 206. Only TMCM-341 and 343."""
    driver_error_flags = Readable("driver_error_flags")
    """What the driver reports: 0 overcurrent on the low side of bridge A, 1 overcurrent on the low side of
    bridge B, 2 open load on bridge A, 3 open load on bridge B, 4 overcurrent on the high side, 5
    undervoltage, 6 temperature warning, 7 overtemperature. 0..255 [bit mask], parameter 208. Only TMCM-341
    and 343."""
    encoder_position = Writable("encoder_position")
    """Counter of the axis's encoder on a TMCM-323. -8388608..8388607 [encoder steps], parameter 209."""
    encoder_prescaler = Writable("encoder_prescaler")
    """What one encoder edge adds to parameter 209 (512 is 1.0); the low bits select null channel functions.
    -2147483648..2147483647 [1/512], parameter 210."""
    fullstep_threshold = Writable("fullstep_threshold")
    """Speed above which the drivers do real full steps; 0 or 2048 never. 0..2048 [velocity units],
    parameter 211. Only TMCM-341 and 343."""
    max_encoder_deviation = Writable("max_encoder_deviation")
    """The motor is stopped when parameters 1 and 209 differ by more; 0 switches the check off. 0..65535
    [microsteps], parameter 212."""
    group_index = Writable("group_index")
    """Motors of one group index do ROR, ROL, MST, MVP and RFS together; 0 is no group. 0..255, parameter
    213."""
    power_down_delay = Writable("power_down_delay")
    """Time at rest before the current goes down to standby. 1..65535 [10 ms], parameter 214. Only TMCM-341
    and 343."""


class ModuleAttributes:
    """The global parameters of bank 0, by their keys."""

    __slots__ = ()

    datagram_low_word = Readable("datagram_low_word")
    """Lower 24 bits of what the motor drivers last sent to the motion chip. 0..16777215, parameter 0."""
    datagram_high_word = Readable("datagram_high_word")
    """Upper 24 bits of what the motor drivers last sent to the motion chip. 0..16777215, parameter 1."""
    cover_position = Writable("cover_position")
    """Where in the drivers' datagram the cover datagram is laid over it. 0..63 [bits], parameter 2."""
    cover_length = Writable("cover_length")
    """How many bits are covered. 0..31 [bits], parameter 3."""
    cover_datagram = Writable("cover_datagram")
    """The bits to send over the drivers' datagram; writing it sends them once. 0..16777215, parameter 4."""
    reference_switches = Readable("reference_switches")
    """All switches as the chip reads them: bit 5 left 3, 4 right 3, 3 left 2, 2 right 2, 1 left 1, 0 right
    1. 0..63 [bit mask], parameter 5."""
    smgp = Writable("smgp")
    """The chip's global motor parameters: drivers, polarities, clock divider, switch inputs. 0..16777215,
    parameter 6."""
    driver_chain_0 = Writable("driver_chain_0")
    """Four cells of the table that describes the drivers' datagram, lowest cell in the lowest byte.
    -2147483648..2147483647, parameter 7."""
    driver_chain_1 = Writable("driver_chain_1")
    """Four cells of the table that describes the drivers' datagram, lowest cell in the lowest byte.
    -2147483648..2147483647, parameter 8."""
    driver_chain_2 = Writable("driver_chain_2")
    """Four cells of the table that describes the drivers' datagram, lowest cell in the lowest byte.
    -2147483648..2147483647, parameter 9."""
    driver_chain_3 = Writable("driver_chain_3")
    """Four cells of the table that describes the drivers' datagram, lowest cell in the lowest byte.
    -2147483648..2147483647, parameter 10."""
    driver_chain_4 = Writable("driver_chain_4")
    """Four cells of the table that describes the drivers' datagram, lowest cell in the lowest byte.
    -2147483648..2147483647, parameter 11."""
    driver_chain_5 = Writable("driver_chain_5")
    """Four cells of the table that describes the drivers' datagram, lowest cell in the lowest byte.
    -2147483648..2147483647, parameter 12."""
    driver_chain_6 = Writable("driver_chain_6")
    """Four cells of the table that describes the drivers' datagram, lowest cell in the lowest byte.
    -2147483648..2147483647, parameter 13."""
    driver_chain_7 = Writable("driver_chain_7")
    """Four cells of the table that describes the drivers' datagram, lowest cell in the lowest byte.
    -2147483648..2147483647, parameter 14."""
    driver_chain_8 = Writable("driver_chain_8")
    """Four cells of the table that describes the drivers' datagram, lowest cell in the lowest byte.
    -2147483648..2147483647, parameter 15."""
    driver_chain_9 = Writable("driver_chain_9")
    """Four cells of the table that describes the drivers' datagram, lowest cell in the lowest byte.
    -2147483648..2147483647, parameter 16."""
    driver_chain_10 = Writable("driver_chain_10")
    """Four cells of the table that describes the drivers' datagram, lowest cell in the lowest byte.
    -2147483648..2147483647, parameter 17."""
    driver_chain_11 = Writable("driver_chain_11")
    """Four cells of the table that describes the drivers' datagram, lowest cell in the lowest byte.
    -2147483648..2147483647, parameter 18."""
    driver_chain_12 = Writable("driver_chain_12")
    """Four cells of the table that describes the drivers' datagram, lowest cell in the lowest byte.
    -2147483648..2147483647, parameter 19."""
    driver_chain_13 = Writable("driver_chain_13")
    """Four cells of the table that describes the drivers' datagram, lowest cell in the lowest byte.
    -2147483648..2147483647, parameter 20."""
    driver_chain_14 = Writable("driver_chain_14")
    """Four cells of the table that describes the drivers' datagram, lowest cell in the lowest byte.
    -2147483648..2147483647, parameter 21."""
    driver_chain_15 = Writable("driver_chain_15")
    """Four cells of the table that describes the drivers' datagram, lowest cell in the lowest byte.
    -2147483648..2147483647, parameter 22."""
    microstep_table_0 = Writable("microstep_table_0")
    """Four six-bit values of the quarter sine wave, lowest in the lowest byte. -2147483648..2147483647,
    parameter 23."""
    microstep_table_1 = Writable("microstep_table_1")
    """Four six-bit values of the quarter sine wave, lowest in the lowest byte. -2147483648..2147483647,
    parameter 24."""
    microstep_table_2 = Writable("microstep_table_2")
    """Four six-bit values of the quarter sine wave, lowest in the lowest byte. -2147483648..2147483647,
    parameter 25."""
    microstep_table_3 = Writable("microstep_table_3")
    """Four six-bit values of the quarter sine wave, lowest in the lowest byte. -2147483648..2147483647,
    parameter 26."""
    microstep_table_4 = Writable("microstep_table_4")
    """Four six-bit values of the quarter sine wave, lowest in the lowest byte. -2147483648..2147483647,
    parameter 27."""
    microstep_table_5 = Writable("microstep_table_5")
    """Four six-bit values of the quarter sine wave, lowest in the lowest byte. -2147483648..2147483647,
    parameter 28."""
    microstep_table_6 = Writable("microstep_table_6")
    """Four six-bit values of the quarter sine wave, lowest in the lowest byte. -2147483648..2147483647,
    parameter 29."""
    microstep_table_7 = Writable("microstep_table_7")
    """Four six-bit values of the quarter sine wave, lowest in the lowest byte. -2147483648..2147483647,
    parameter 30."""
    microstep_table_8 = Writable("microstep_table_8")
    """Four six-bit values of the quarter sine wave, lowest in the lowest byte. -2147483648..2147483647,
    parameter 31."""
    microstep_table_9 = Writable("microstep_table_9")
    """Four six-bit values of the quarter sine wave, lowest in the lowest byte. -2147483648..2147483647,
    parameter 32."""
    microstep_table_10 = Writable("microstep_table_10")
    """Four six-bit values of the quarter sine wave, lowest in the lowest byte. -2147483648..2147483647,
    parameter 33."""
    microstep_table_11 = Writable("microstep_table_11")
    """Four six-bit values of the quarter sine wave, lowest in the lowest byte. -2147483648..2147483647,
    parameter 34."""
    microstep_table_12 = Writable("microstep_table_12")
    """Four six-bit values of the quarter sine wave, lowest in the lowest byte. -2147483648..2147483647,
    parameter 35."""
    microstep_table_13 = Writable("microstep_table_13")
    """Four six-bit values of the quarter sine wave, lowest in the lowest byte. -2147483648..2147483647,
    parameter 36."""
    microstep_table_14 = Writable("microstep_table_14")
    """Four six-bit values of the quarter sine wave, lowest in the lowest byte. -2147483648..2147483647,
    parameter 37."""
    microstep_table_15 = Writable("microstep_table_15")
    """Four six-bit values of the quarter sine wave, lowest in the lowest byte. -2147483648..2147483647,
    parameter 38."""
    eeprom_magic = Writable("eeprom_magic")
    """Any value but $E4 brings back the factory defaults at the next power-on. 0..255, parameter 64."""
    baud_rate = Writable("baud_rate")
    """Speed of the serial interface. 0..11, parameter 65."""
    serial_address = Writable("serial_address")
    """Address of the module on RS232 and RS485. 0..255, parameter 66."""
    ascii_mode = Writable("ascii_mode")
    """Bit 0: start in ASCII mode. Bits 5 and 4: echo of each character (00), of the whole line (01), none
    (10). 0..255 [bit mask], parameter 67."""
    serial_heartbeat = Writable("serial_heartbeat")
    """The motors are stopped when no command comes for this time; 0 switches the watch off. 0..65535 [ms],
    parameter 68."""
    can_bit_rate = Writable("can_bit_rate")
    """Speed of the CAN interface. 1..8, parameter 69."""
    can_reply_id = Writable("can_reply_id")
    """CAN identifier of the module's replies. 0..2047, parameter 70."""
    can_id = Writable("can_id")
    """CAN identifier that the module listens to. 0..2047, parameter 71."""
    eeprom_lock = Writable("eeprom_lock")
    """Write 1234 to lock the configuration EEPROM, 4321 to unlock it; reads 1 while locked. 0..4321,
    parameter 73."""
    encoder_interface = Writable("encoder_interface")
    """Where a TMCM-323 encoder module is connected. 0..3, parameter 74."""
    telegram_pause = Writable("telegram_pause")
    """Wait before a reply on RS232 or RS485; RS485 adapters switched by RTS need about 15. 0..255 [ms],
    parameter 75."""
    host_address = Writable("host_address")
    """First byte of serial replies. 0..255, parameter 76."""
    auto_start = Writable("auto_start")
    """1 starts the stored program at power-on. 0..1, parameter 77."""
    shutdown_pin = Writable("shutdown_pin")
    """What the SHUTDOWN pin does: nothing, or stop all motors while high or while low. 0..2, parameter
    80."""
    code_protection = Writable("code_protection")
    """Forbids reading (1), overwriting (2) or both (3) of the program; giving up 1 or 3 erases the program.
    0..3, parameter 81."""
    can_secondary_id = Writable("can_secondary_id")
    """Second CAN identifier that the module listens to; 0 is none. 0..2047, parameter 83."""
    coordinate_storage = Writable("coordinate_storage")
    """Where coordinates 1 to 20 are stored. 0..1, parameter 84."""
    keep_user_variables_cleared = Writable("keep_user_variables_cleared")
    """1 leaves the user variables at 0 at power-on. 0..1, parameter 85."""
    application_status = Readable("application_status")
    """What the program is doing. 0..3, parameter 128."""
    download_mode = Readable("download_mode")
    """1 while commands are stored instead of executed. 0..1, parameter 129."""
    program_counter = Readable("program_counter")
    """Address of the command being executed. 0..2048, parameter 130."""
    tick_timer = Writable("tick_timer")
    """Counts milliseconds; may be set. -2147483648..2147483647 [ms], parameter 132."""
    random_number = Readable("random_number")
    """Another number at each reading. 0..2147483647, parameter 133."""
    disable_reply = Writable("disable_reply")
    """1 keeps the module from answering. 0..1, parameter 255."""
