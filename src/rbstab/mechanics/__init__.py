"""One rigid body: its attitude, its contact point, its constraint and its coordinates.

Every function here is plain numpy notation without a branch on a value and without an in-place
write, so that floats, complex numbers, intervals and symbolic expressions all pass through it.
"""
