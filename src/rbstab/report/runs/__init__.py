"""What a report says of runs: tables, figures and motions."""
