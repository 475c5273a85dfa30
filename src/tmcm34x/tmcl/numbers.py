"""Numbers of commands and parameters by name, for code: `AP.MAX_SPEED`, `GP.CAN_ID`, `COMMAND.MVP`.

The names are the keys of the rows in capitals; the numbers come from the rows.  A test holds names and rows together.
"""

from __future__ import annotations

from typing import Final

from tmcm34x.tmcl import axis_parameters, commands, global_parameters

_AXIS: Final = {
    row.key: row for row in (*axis_parameters.AXIS_PARAMETERS, *axis_parameters.LATER_AXIS_PARAMETERS)
}
_GLOBAL: Final = {
    row.key: row for row in (*global_parameters.GLOBAL_PARAMETERS, *global_parameters.LATER_GLOBAL_PARAMETERS)
}


def _axis(key: str) -> int:
    return _AXIS[key].number


def _global(key: str) -> int:
    return _GLOBAL[key].number


def _command(mnemonic: str) -> int:
    return commands.BY_MNEMONIC[mnemonic].number


def _control(key: str) -> int:
    return commands.CONTROL_BY_KEY[key].number


class AP:
    """Axis parameters."""

    TARGET_POSITION: Final = _axis("target_position")
    ACTUAL_POSITION: Final = _axis("actual_position")
    TARGET_SPEED: Final = _axis("target_speed")
    ACTUAL_SPEED: Final = _axis("actual_speed")
    MAX_SPEED: Final = _axis("max_speed")
    MAX_ACCELERATION: Final = _axis("max_acceleration")
    MAX_CURRENT: Final = _axis("max_current")
    STANDBY_CURRENT: Final = _axis("standby_current")
    POSITION_REACHED: Final = _axis("position_reached")
    REFERENCE_SWITCH: Final = _axis("reference_switch")
    RIGHT_SWITCH: Final = _axis("right_switch")
    LEFT_SWITCH: Final = _axis("left_switch")
    RIGHT_SWITCH_DISABLE: Final = _axis("right_switch_disable")
    LEFT_SWITCH_DISABLE: Final = _axis("left_switch_disable")
    MIN_SPEED: Final = _axis("min_speed")
    ACTUAL_ACCELERATION: Final = _axis("actual_acceleration")
    RAMP_MODE: Final = _axis("ramp_mode")
    MICROSTEP_RESOLUTION: Final = _axis("microstep_resolution")
    SOFT_STOP: Final = _axis("soft_stop")
    RAMP_DIVISOR: Final = _axis("ramp_divisor")
    PULSE_DIVISOR: Final = _axis("pulse_divisor")
    REFERENCE_MODE: Final = _axis("reference_mode")
    REFERENCE_SEARCH_SPEED: Final = _axis("reference_search_speed")
    REFERENCE_SWITCH_SPEED: Final = _axis("reference_switch_speed")
    END_SWITCH_DISTANCE: Final = _axis("end_switch_distance")
    MIXED_DECAY_THRESHOLD: Final = _axis("mixed_decay_threshold")
    FREEWHEELING: Final = _axis("freewheeling")
    STALL_THRESHOLD: Final = _axis("stall_threshold")
    LOAD_VALUE: Final = _axis("load_value")
    DRIVER_ERROR_FLAGS: Final = _axis("driver_error_flags")
    ENCODER_POSITION: Final = _axis("encoder_position")
    ENCODER_PRESCALER: Final = _axis("encoder_prescaler")
    FULLSTEP_THRESHOLD: Final = _axis("fullstep_threshold")
    MAX_ENCODER_DEVIATION: Final = _axis("max_encoder_deviation")
    GROUP_INDEX: Final = _axis("group_index")
    POWER_DOWN_DELAY: Final = _axis("power_down_delay")
    REFERENCE_SWITCH_TOLERANCE: Final = _axis("reference_switch_tolerance")
    LAST_REFERENCE_POSITION: Final = _axis("last_reference_position")
    BOOST_CURRENT: Final = _axis("boost_current")
    EXTENDED_ERROR_FLAGS: Final = _axis("extended_error_flags")


class GP:
    """Global parameters of bank 0; of the driver chain and the microstep table the first long words."""

    DATAGRAM_LOW_WORD: Final = _global("datagram_low_word")
    DATAGRAM_HIGH_WORD: Final = _global("datagram_high_word")
    COVER_POSITION: Final = _global("cover_position")
    COVER_LENGTH: Final = _global("cover_length")
    COVER_DATAGRAM: Final = _global("cover_datagram")
    REFERENCE_SWITCHES: Final = _global("reference_switches")
    SMGP: Final = _global("smgp")
    DRIVER_CHAIN_0: Final = _global("driver_chain_0")
    MICROSTEP_TABLE_0: Final = _global("microstep_table_0")
    EEPROM_MAGIC: Final = _global("eeprom_magic")
    BAUD_RATE: Final = _global("baud_rate")
    SERIAL_ADDRESS: Final = _global("serial_address")
    ASCII_MODE: Final = _global("ascii_mode")
    SERIAL_HEARTBEAT: Final = _global("serial_heartbeat")
    CAN_BIT_RATE: Final = _global("can_bit_rate")
    CAN_REPLY_ID: Final = _global("can_reply_id")
    CAN_ID: Final = _global("can_id")
    EEPROM_LOCK: Final = _global("eeprom_lock")
    ENCODER_INTERFACE: Final = _global("encoder_interface")
    TELEGRAM_PAUSE: Final = _global("telegram_pause")
    HOST_ADDRESS: Final = _global("host_address")
    AUTO_START: Final = _global("auto_start")
    SHUTDOWN_PIN: Final = _global("shutdown_pin")
    CODE_PROTECTION: Final = _global("code_protection")
    CAN_SECONDARY_ID: Final = _global("can_secondary_id")
    COORDINATE_STORAGE: Final = _global("coordinate_storage")
    KEEP_USER_VARIABLES_CLEARED: Final = _global("keep_user_variables_cleared")
    APPLICATION_STATUS: Final = _global("application_status")
    DOWNLOAD_MODE: Final = _global("download_mode")
    PROGRAM_COUNTER: Final = _global("program_counter")
    TICK_TIMER: Final = _global("tick_timer")
    RANDOM_NUMBER: Final = _global("random_number")
    DISABLE_REPLY: Final = _global("disable_reply")
    CAN_HEARTBEAT: Final = _global("can_heartbeat")
    SERIAL_SECONDARY_ADDRESS: Final = _global("serial_secondary_address")
    LAST_ERROR: Final = _global("last_error")


class COMMAND:
    """Commands with a mnemonic, and the end of a program."""

    END: Final = 0
    ROR: Final = _command("ROR")
    ROL: Final = _command("ROL")
    MST: Final = _command("MST")
    MVP: Final = _command("MVP")
    SAP: Final = _command("SAP")
    GAP: Final = _command("GAP")
    STAP: Final = _command("STAP")
    RSAP: Final = _command("RSAP")
    SGP: Final = _command("SGP")
    GGP: Final = _command("GGP")
    STGP: Final = _command("STGP")
    RSGP: Final = _command("RSGP")
    RFS: Final = _command("RFS")
    SIO: Final = _command("SIO")
    GIO: Final = _command("GIO")
    CALC: Final = _command("CALC")
    COMP: Final = _command("COMP")
    JC: Final = _command("JC")
    JA: Final = _command("JA")
    CSUB: Final = _command("CSUB")
    RSUB: Final = _command("RSUB")
    WAIT: Final = _command("WAIT")
    STOP: Final = _command("STOP")
    SAC: Final = _command("SAC")
    SCO: Final = _command("SCO")
    GCO: Final = _command("GCO")
    CCO: Final = _command("CCO")
    CALCX: Final = _command("CALCX")
    AAP: Final = _command("AAP")
    AGP: Final = _command("AGP")
    CLE: Final = _command("CLE")
    ACO: Final = _command("ACO")
    UF0: Final = _command("UF0")
    UF1: Final = _command("UF1")
    UF2: Final = _command("UF2")
    UF3: Final = _command("UF3")
    UF4: Final = _command("UF4")
    UF5: Final = _command("UF5")
    UF6: Final = _command("UF6")
    UF7: Final = _command("UF7")


class CONTROL:
    """Control functions."""

    STOP_APPLICATION: Final = _control("stop_application")
    RUN_APPLICATION: Final = _control("run_application")
    STEP_APPLICATION: Final = _control("step_application")
    RESET_APPLICATION: Final = _control("reset_application")
    START_DOWNLOAD: Final = _control("start_download")
    QUIT_DOWNLOAD: Final = _control("quit_download")
    READ_PROGRAM_MEMORY: Final = _control("read_program_memory")
    GET_APPLICATION_STATUS: Final = _control("get_application_status")
    GET_FIRMWARE_VERSION: Final = _control("get_firmware_version")
    RESTORE_FACTORY_SETTINGS: Final = _control("restore_factory_settings")
    REQUEST_TARGET_REACHED: Final = _control("request_target_reached")
    ENTER_ASCII_MODE: Final = _control("enter_ascii_mode")
    ENTER_BOOT_LOADER: Final = _control("enter_boot_loader")
