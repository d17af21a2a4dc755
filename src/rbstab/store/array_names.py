"""The names of arrays: how keys are written as names, and an error about a wrong one."""

import re
from collections.abc import Iterable
from difflib import get_close_matches

MAX_LISTED = 40
"""The most names that an error lists."""


def no_such_array(name: object, known: Iterable[str], kind: str = "array") -> KeyError:
    """Return the error about a name that no array has: the name that was meant, or all names."""
    names = list(known)
    close = get_close_matches(str(name), names, n=1)
    if close:
        return KeyError(f"no {kind} {name!r}; did you mean {close[0]}?")
    rest = ", ..." if len(names) > MAX_LISTED else ""
    return KeyError(f"no {kind} {name!r}; there are: {', '.join(names[:MAX_LISTED])}{rest}")


def safe_name(key: str) -> str:
    """Return a config key as a netCDF name, such as `body_inertia_0` for `body.inertia[0]`."""
    return re.sub(r"[^A-Za-z0-9_]+", "_", key).strip("_")
