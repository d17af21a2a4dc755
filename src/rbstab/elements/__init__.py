"""Passive elements, each with its wrench, stored energy, dissipation and own states.

The formulas of an element are only in its file. The Lyapunov function is the kinetic energy of the
body plus the stored energy of the elements. Its derivative is minus the sum of their dissipations.
A new connector needs one new file and one line in `registry.py`.
"""
