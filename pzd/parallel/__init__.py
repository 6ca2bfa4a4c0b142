"""Work in chunks, on the cores of one machine or on a cluster: the same results wherever it is done."""
