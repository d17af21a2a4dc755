"""Reading the results for a report."""
