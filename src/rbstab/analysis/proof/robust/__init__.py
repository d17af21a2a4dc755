"""Proofs for all bodies in a box: gains, contact point, mass or gravity within tolerances."""
