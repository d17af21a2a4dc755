"""A cache of compiled code, one for each thread.

Each thread needs its own, because an integrator holds the state of its run.
"""

import threading
from collections import OrderedDict
from collections.abc import Callable, Hashable
from typing import Any, TypeVar, cast

T = TypeVar("T")

MAX_CACHED = 32
"""The maximum number of entries for a thread. A sweep needs a few for each variant, and more if it
varies the tolerance."""


_cache = threading.local()
"""Its `entries` are those of the current thread, the least recently used first."""


def compiled_once(key: Hashable, compile_entry: Callable[[], T]) -> T:
    """Return the compiled entry of a key; compile it if this thread has none.

    Args:
        key: The kind of the entry, and everything that its code depends on.
        compile_entry: Compiles the entry.
    """
    entries: OrderedDict[Hashable, Any] = vars(_cache).setdefault("entries", OrderedDict())
    if key not in entries:
        entries[key] = compile_entry()
        if len(entries) > MAX_CACHED:
            entries.popitem(last=False)
    entries.move_to_end(key)
    return cast("T", entries[key])
