"""The energies of guards of θ2 with proved bounds: barriers, soft guards, stops."""
