"""Reading through a library that loses errors of the disk."""

from typing import BinaryIO


class CheckedReads:
    """A file that keeps its first read error, because h5py drops it or raises another one.

    Args:
        file: A file that is open for reading.

    Attributes:
        error: A copy of the first error, or None. The error itself must not be kept: its traceback
            refers to h5py's frames, and these to this object. h5py would then never free the file,
            and would crash at exit.
    """

    def __init__(self, file: BinaryIO) -> None:
        self.error: OSError | None = None
        self._file = file
        self.seek, self.tell = file.seek, file.tell

    def read(self, size: int = -1) -> bytes:
        """Read bytes, at most `size`; errors as for files."""
        try:
            return self._file.read(size)
        except OSError as error:
            self._keep(error)
            raise

    def readinto(self, buffer: memoryview) -> int:
        """Read bytes into a buffer, and return their number; errors as for files."""
        try:
            return self._file.readinto(buffer)  # type: ignore[attr-defined]
        except OSError as error:
            self._keep(error)
            raise

    def raise_error(self) -> None:
        """Raise the first error, if there was one."""
        if self.error is not None:
            raise self.error

    def _keep(self, error: OSError) -> None:
        self.error = self.error or OSError(error.errno, error.strerror or str(error))
