"""Keep what is computed of a sweep: several blocks of a report ask for the same numbers."""

from collections.abc import Callable
from functools import wraps
from typing import TypeVar
from weakref import WeakKeyDictionary

from rbstab.report.sweeps.members import Members

Found = TypeVar("Found")


def kept(function: Callable[[Members], Found]) -> Callable[[Members], Found]:
    """Return a function that computes its value once for each sweep in memory.

    Args:
        function: Its value may be shared: nobody changes it.
    """
    known: WeakKeyDictionary[Members, Found] = WeakKeyDictionary()

    @wraps(function)
    def call(members: Members) -> Found:
        if members not in known:
            known[members] = function(members)
        return known[members]

    return call
