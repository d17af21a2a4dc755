"""What the commands of sweeps print: progress, outcomes, and what is proved."""
