"""What a sweep varies: a plan of numbered members, read, checked and written."""
