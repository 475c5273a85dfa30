"""Recordings of what passes between hosts and modules: made, shown, converted, and compared with our module.

`record`        one telegram, frame or text with its time, and what it says
`session_file`  recordings as sessions with times (docs/sessions.md)
`pcapng`        for Wireshark, with `dissector`
`candump`       logs of the Linux can-utils
`hexlog`        plain text logs of telegrams in hexadecimal
`files`         any of these by a file's name
`latency`       requests with their replies
`fidelity`      which fidelity entries a command touches
`check`         the host's side of a recording played against a virtual module
`tap`           recordings of a server's lines
`proxy`         recordings of lines that pass through this process
"""
