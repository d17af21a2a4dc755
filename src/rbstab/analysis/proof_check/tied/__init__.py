"""Check proofs for a tied body with springs: in Θ and in the shift z of its position."""
