"""Energies of elements of users, as the operations that their code did, with proved bounds."""
