"""Reading a YAML file into a validated, immutable description of one experiment."""
