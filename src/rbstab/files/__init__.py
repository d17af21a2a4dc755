"""Files that users name: whether they exist, opening them, and their names in messages."""
