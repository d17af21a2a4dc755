"""One rigid body: its attitude, its contact point, its constraint and its coordinates.

The equations are written in numpy notation. They never branch on a value and never write in place.
So they accept floats, complex numbers, intervals and symbolic expressions.
"""
