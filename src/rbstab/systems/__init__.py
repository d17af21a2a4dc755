"""Systems: a body, its elements, its anchor and the coordinates in which its motion is written."""
