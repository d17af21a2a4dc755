"""`rbstab sweep`: running a plan, its progress, what is proved afterwards, and what is printed."""
