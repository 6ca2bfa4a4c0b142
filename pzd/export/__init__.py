"""The damper of a run in the form that other tools take, one file a format in `formats/`."""
