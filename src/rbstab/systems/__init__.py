"""Systems: a body with its elements, its anchor and the coordinates of its motion."""
