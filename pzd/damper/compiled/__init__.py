"""The effects found, as compiled laws and as columns of parameter rows.

A parameter row is all the numbers of the damper at one moment, in a fixed order: T0, C and k, then every parameter of
every stroke and flow effect known, neutral where the damper lacks it. So a compiled loop takes any damper, with any
effects and with parameters that follow the voltage, as one tuple of numbers (`kernels.Row`), and an effect is switched
by a value. The drive, and the forces parallel to the element, have rows of their own. `columns` says which parameter
stands where, `kernels` holds the laws that read them, `pzd.damper.parameter_rows` fills them from a damper.
"""
