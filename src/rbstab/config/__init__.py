"""From a YAML file to a validated, immutable description of one experiment."""
