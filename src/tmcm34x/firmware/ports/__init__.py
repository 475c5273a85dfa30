"""How telegrams reach a module: serial lines with their ASCII interface, and CAN.

A port takes bytes by `receive` or frames by `receive_frame`, and passes replies to a `send` callable; it is independent
of links.
"""
