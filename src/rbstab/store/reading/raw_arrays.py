"""Arrays read from their places in a file, without asking HDF5."""

from pathlib import Path
from typing import Any, BinaryIO, NamedTuple

import numpy as np
from numpy.typing import NDArray

from rbstab.store.errors import NotAResultError
from rbstab.store.reading.text_heaps import Texts
from rbstab.store.reading.types import MAX_TEXT_BYTES, TEXT_REFERENCE


class RawArrays(NamedTuple):
    """The bytes of a file.

    Attributes:
        path: The file.
        raw: The file, open for reading.
        stored_texts: Where its texts are.
        base: The byte from which HDF5 counts; zero in the files of rbstab.
    """

    path: Path
    raw: BinaryIO
    stored_texts: Texts
    base: int

    def numbers(self, offset: int, dtype: np.dtype[Any], shape: tuple[int, ...]) -> NDArray[Any]:
        """Read numbers from a place in the file, whatever is there.

        Raises:
            NotAResultError: The file ends before.
        """
        data = np.empty(shape, dtype)
        self.raw.seek(offset)
        size = self.raw.readinto(data.reshape(-1).view("u1").data)  # type: ignore[attr-defined]
        if size != data.nbytes:
            raise NotAResultError(f"{self.path} is damaged: it became shorter while it was read")
        return data

    def texts(self, name: str, offset: int, shape: tuple[int, ...]) -> NDArray[Any]:
        """Read texts whose references are at a place in the file, whatever is there.

        Args:
            name: The name of the array, for messages.
            offset: The first byte of the references.
            shape: The shape of the array.

        Raises:
            NotAResultError: They lead to no text, or to more text than rbstab writes.
        """
        references = self.numbers(offset, TEXT_REFERENCE, shape)
        # Many references may lead to one long text: so the lengths are added before it is read.
        total = references["length"].sum(dtype=np.int64)
        if total > MAX_TEXT_BYTES:
            raise NotAResultError(
                f"{self.path}: {name} has {total / 1e6:.3g} MB of text, more than rbstab writes"
            )
        found = [self._text(*reference) for reference in references.ravel().tolist()]
        return np.array(found, dtype=object).reshape(shape)

    def _text(self, length: int, address: int, index: int) -> str:
        if not length:
            return ""
        span = self.stored_texts.get((address + self.base, index))
        if span is None or length > span.size:
            raise NotAResultError(
                f"{self.path} is damaged: it has a reference to a text that is not there"
            )
        self.raw.seek(span.start)
        content = self.raw.read(length)
        # As in C, a text ends before its first zero.
        return content.partition(b"\0")[0].decode()
