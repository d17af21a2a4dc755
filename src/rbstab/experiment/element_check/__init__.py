"""Tests of the statements of an element of a user, at random states."""
