"""Single figures as files: drawings for papers, and their data."""
