"""Tests of every equation of the paper, named by its number."""
