"""From members to outcomes: the engines that integrate them, and what is kept of each."""
