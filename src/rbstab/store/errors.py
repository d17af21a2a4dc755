"""Errors of reading and writing results."""


class StoreError(Exception):
    """A result, a sweep or its traces cannot be written or read."""


class NotAResultError(StoreError):
    """A file is damaged, or is not a result of rbstab."""


class NewerSchemaError(StoreError):
    """A file was written by a newer rbstab, in a format that this one cannot read."""


class ResultExistsError(StoreError):
    """A result cannot be written because a file with its name exists."""
