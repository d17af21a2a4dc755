"""Writers: a report as a page, as PDF, Markdown, text or plain data."""
