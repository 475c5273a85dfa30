"""A bench on links: virtual time paced to the wall clock, bytes carried between clients and modules.

Everything below this package lives in virtual time; this is where it meets the clock on the wall, files and
the outside world.

Read in this order: `pace`, `server`, `eeprom_file`, `store`, `telegram_log`, `output`, `control`, `counters`.
"""

from tmcm34x.server.eeprom_file import EepromFile, EepromFileError
from tmcm34x.server.pace import Pace
from tmcm34x.server.server import Server
from tmcm34x.server.store import Store
from tmcm34x.server.telegram_log import TelegramLog

__all__ = ["EepromFile", "EepromFileError", "Pace", "Server", "Store", "TelegramLog"]
