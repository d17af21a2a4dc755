"""The table of claims: what the program proves about many bodies, and whether it still does.

`python -m support.claims make` writes the table, `ask` adds proofs that are asked for, and
`compare` compares the program with the table. Only `program` asks the program; a program with other
proofs needs another `claims_of`, and nothing else here.
"""
