"""Slices of the vectors in a state vector: `y[THETA]` is Θ.

The body's states are Z = [Θ, Ω, X, V] or W = [Θ, Ω, E, F] (eq. 1, 4).
"""

THETA = slice(0, 3)
"""Θ, rad, in Z and W."""

PITCH = 1
"""The index of θ2 in Θ, and so in every state vector."""

OMEGA = slice(3, 6)
"""Ω, rad/s, body, in Z and W."""

X_OF_Z = slice(6, 9)
"""X, m, inertial, in Z."""

V_OF_Z = slice(9, 12)
"""V, m/s, inertial, in Z."""

E_OF_W = slice(6, 9)
"""E, m, inertial, in W."""

F_OF_W = slice(9, 12)
"""F, m/s, inertial, in W."""

BODY = slice(0, 12)
"""Z or W. After them come the own states of elements and the audit states."""
