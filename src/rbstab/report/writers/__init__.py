"""Writers of a report: HTML, PDF, Markdown, terminal text and plain data."""
