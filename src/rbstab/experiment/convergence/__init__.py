"""The convergence of the exact motion of a run: its proof, its storage, and the computed motion."""
