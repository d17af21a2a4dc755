"""The command line of rbstab."""
