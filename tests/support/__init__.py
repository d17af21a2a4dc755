"""What tests share: systems to try the equations on, and the reference trajectories."""
