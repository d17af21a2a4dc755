"""A motion and its derivative along a direction of the parameters and the initial state."""
