"""Files that users name: whether they exist, opening them, their names in messages; and counts."""
