"""Descents in energy to a minimum: of smooth energies, and of energies with kinks."""
