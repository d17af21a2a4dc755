"""Commands that write the files with which a new user begins."""
