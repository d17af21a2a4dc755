"""A test for every equation of the paper, by its number."""
