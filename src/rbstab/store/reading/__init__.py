"""Reading HDF5 files that may be damaged, hostile, or written by other programs.

The program writes simple files: arrays of numbers or texts in one piece, without filters. Anything
else is refused before it is read. So reading never needs much more memory than the file has bytes.
"""
