"""Validators of the JSON Schemas for editors, and their errors in a YAML text."""

import jsonschema

from rbstab.config.source import parse_source


def validator_of(schema):
    """Check that a schema is valid itself, and return its validator."""
    jsonschema.Draft202012Validator.check_schema(schema)
    return jsonschema.Draft202012Validator(schema)


def schema_errors(validator, text):
    """Return the errors that a schema finds in a YAML text."""
    return list(validator.iter_errors(parse_source(text, "a").data))
