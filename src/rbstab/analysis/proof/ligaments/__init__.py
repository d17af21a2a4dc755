"""Ligaments as parts of a reduced energy: of a held body, and of one whose position is free."""
