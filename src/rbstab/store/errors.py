"""What can go wrong between a result and the disk."""


class StoreError(Exception):
    """A result cannot be written or read."""


class NotAResultError(StoreError):
    """The file is not a result of rbstab, or is damaged."""


class NewerSchemaError(StoreError):
    """The file was written by a newer rbstab, in a format that this one does not know."""


class ResultExistsError(StoreError):
    """A result stands where one was to be written."""
