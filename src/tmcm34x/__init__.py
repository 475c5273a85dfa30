"""A software TMCM-341/342/343: module, firmware V4.36, chips, and the tools beside it."""

__version__ = "0.1.0"
