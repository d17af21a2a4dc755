"""Reading the results that a report is made from."""
