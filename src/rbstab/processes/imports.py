"""Garbage collection of the process while it imports and ends."""

import gc
from collections.abc import Iterator
from contextlib import contextmanager


@contextmanager
def keep_imports() -> Iterator[None]:
    """Import without garbage collection, and exclude what was imported from all later ones.

    Modules live as long as the process. While the many objects of a first import are created,
    Python would search all of them for garbage again and again, and once more when it ends. Objects
    created after the block are collected as always.
    """
    was_enabled = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        gc.freeze()
        if was_enabled:
            gc.enable()
