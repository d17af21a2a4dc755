"""Elements that never gain energy: what is shown of the code of users, and what damps a motion."""
