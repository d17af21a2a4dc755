"""Integration of many members of one structure, in compiled batches."""
