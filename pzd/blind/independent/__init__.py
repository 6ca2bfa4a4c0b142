"""A second generator of rig data, written from the laws alone, to try the diagnosis on data of other authorship."""
