"""The table of claims: what the program proves about many configs, and that it stays so."""
