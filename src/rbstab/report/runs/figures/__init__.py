"""The figures of single runs: what is drawn of their stored arrays."""
