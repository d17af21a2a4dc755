"""The table of claims: what the program proves about many bodies, and whether it still does.

`python -m support.claims make` writes the table, `compare` compares the program with it, `times`
prints how long the proofs took. Only `program` asks the program; a program with other proofs needs
another `claims_of`, and nothing else here.
"""
