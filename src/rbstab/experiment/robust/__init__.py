"""Proofs for all configs within tolerances: how they are made, stored, and used."""
