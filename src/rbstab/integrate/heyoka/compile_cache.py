"""What was compiled is kept: once for each structure of equations, in each thread.

One for each thread, because an integrator holds the state of its run.
"""

import threading
from collections import OrderedDict
from collections.abc import Callable, Hashable
from typing import Any, TypeVar, cast

T = TypeVar("T")

MAX_KEPT = 32
"""Things that a thread keeps: a sweep needs a few for each variant, but may vary its tolerance."""


class _Kept(threading.local):
    """What this thread has compiled, that which was used longest ago first."""

    def __init__(self) -> None:
        self.things: OrderedDict[Hashable, Any] = OrderedDict()


_kept = _Kept()


def compiled_once(key: Hashable, make: Callable[[], T]) -> T:
    """What this thread has compiled under a key, made if it is not there.

    Args:
        key: Everything that the compiled code depends on, and what it is.
        make: Compiles.
    """
    things = _kept.things
    if key not in things:
        things[key] = make()
        if len(things) > MAX_KEPT:
            things.popitem(last=False)
    things.move_to_end(key)
    return cast("T", things[key])
