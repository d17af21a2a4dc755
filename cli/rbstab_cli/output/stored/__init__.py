"""What `rbstab show` prints of everything that is not the file of a run."""
