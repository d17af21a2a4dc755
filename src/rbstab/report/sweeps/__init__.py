"""What is said of a sweep, part by part; `rbstab.report.sweep_sections` puts the parts together."""
