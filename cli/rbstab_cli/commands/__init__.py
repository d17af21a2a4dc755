"""The commands of `rbstab`, one file each."""
