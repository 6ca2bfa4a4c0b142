"""Forces that no single effect of the library is, one file each; each says what would describe it rightly.

`DESCRIBED_BY` names the effects of the library with which a verdict is right about it: nothing where the right word is
`unexplained`. `unexplained` is right about all of them.
"""
