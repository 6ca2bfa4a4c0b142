"""The front door: what a notebook needs, on arrays and DataFrames.

The stages do the work. Here it is handed in and out, and a mistake becomes a ValueError in the words of the command
line.
"""
