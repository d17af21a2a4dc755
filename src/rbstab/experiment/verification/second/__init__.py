"""A second opinion on a proof, by the solver of codac, which nobody here wrote."""
