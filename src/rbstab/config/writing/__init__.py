"""Writing configs: plain data as YAML, and files of schema version 1 as version 2."""
