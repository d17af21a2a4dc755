"""Elements that supply power: forces and couples, and the signals with which they change."""
