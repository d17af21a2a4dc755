"""The content of a report in any format: sections, tables, figures, text."""
