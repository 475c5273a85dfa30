"""The TMCL firmware V4.36, in the order its parts meet a telegram.

`serial` and `can` are the ports; `module` joins everything and decides the order of work; `dispatch` finds the
handler of a command; `parameters`, `motion` and `io` are what the handlers do; `storage` is the EEPROM;
`supervision` watches the motors; `program` runs stand-alone programs, `reference` searches reference points,
`ascii` is the text interface.
"""
