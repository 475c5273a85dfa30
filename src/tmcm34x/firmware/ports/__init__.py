"""How telegrams reach a module: serial lines with their ASCII interface, and CAN.

A port takes bytes or frames by `receive` and hands its answers to a `send` callable; it knows no link.
"""
