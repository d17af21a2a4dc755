"""Memory of large arrays that is used again, because allocating it costs as much as filling it."""

import numpy as np

from rbstab.mechanics.numbers import Array


class ReusedMemory:
    """Arrays by name; each is valid until the next call with its name."""

    def __init__(self) -> None:
        self._buffers: dict[str, Array] = {}

    def array(self, name: str, shape: tuple[int, ...]) -> Array:
        """Return an array of a shape; calls with the same name reuse its memory."""
        size = int(np.prod(shape))
        if name not in self._buffers or self._buffers[name].size < size:
            self._buffers[name] = np.empty(size)
        return self._buffers[name][:size].reshape(shape)
