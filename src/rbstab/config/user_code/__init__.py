"""Elements of users in a config: their section, their file, and the permission to run it."""
