"""Elements of users: a class in a Python file, read without running it, and run where allowed."""
