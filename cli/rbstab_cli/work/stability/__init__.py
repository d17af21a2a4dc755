"""`rbstab stability`: rest states, proofs within tolerances, and root loci."""
