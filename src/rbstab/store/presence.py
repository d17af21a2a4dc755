"""Whether a file is there, where the system may refuse to tell."""

from pathlib import Path

from rbstab.store.errors import StoreError


def path_exists(path: Path) -> bool:
    """Whether something has this path.

    Raises:
        StoreError: That cannot be known: its folder may not be searched, or its name is too long.
    """
    try:
        return path.exists()
    except OSError as error:
        raise StoreError(f"{path} cannot be read: {error.strerror or error}") from error
