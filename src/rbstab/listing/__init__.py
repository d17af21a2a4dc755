"""What stands in a folder of results, and how two results differ."""
