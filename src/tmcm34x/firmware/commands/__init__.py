"""What the commands do: one function a command, named `do_MNEMONIC`, of the module's state and three operands.

Each gives back a status and the value of the reply: the command's own value where nothing is read, 0 where reading
fails (fidelity FW-5, FW-6).  Ranges that the command's row sets are checked before it is called (`dispatch`).  A
refused command changes nothing.
"""
