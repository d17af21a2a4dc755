"""Report sections on runs: tables, figures and animated motions."""
