"""What a report consists of, independent of its format: sections, tables, figures, words."""
