"""Proofs for a body with springs that is not held: functions of Θ and of its position."""
