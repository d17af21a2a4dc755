"""Testing whether a path exists, when the file system may return an error."""

from pathlib import Path

from rbstab.store.errors import StoreError


def path_exists(path: Path) -> bool:
    """Whether a file or folder exists at this path.

    Raises:
        StoreError: The path cannot be tested: its folder is not accessible, or its name is too
            long.
    """
    try:
        return path.exists()
    except OSError as error:
        raise StoreError(f"{path} cannot be read: {error.strerror or error}") from error
