"""Rest states along a parameter: branches that are followed, and intervals that are proved."""
