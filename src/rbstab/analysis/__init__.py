"""What a motion and a system say about stability."""
