"""Two caches of compiled code: of integrators in each thread, and heyoka's on the disk.

An integrator holds the state of its run, so each thread needs its own.

heyoka keeps compiled code in an SQLite database, so that a later process need not compile it again.
The database lies in the cache folder of the user, or in `HEYOKA_CACHE_DIR`. heyoka removes the code
that was not used for the longest time, but only beyond 20 GB, and each process that opens the
database reads all of it. rbstab uses a subfolder with a limit of its own, so that other programs
with heyoka keep theirs.
"""

import sqlite3
import threading
from collections import OrderedDict
from collections.abc import Callable, Hashable
from contextlib import closing, suppress
from pathlib import Path
from typing import Any, NamedTuple, TypeVar, cast

import heyoka as hy

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


LIMIT = 200_000_000
"""bytes of compiled code; one variant of a config needs some 2 MB."""

FOLDER = "rbstab"
"""The subfolder of heyoka's cache folder."""

DATABASE = "cache.db"
"""The name that heyoka gives its database."""

_state = hy.llvm_state


class CacheError(Exception):
    """The database cannot be read or cleared.

    Args:
        reason: What heyoka reports.
    """

    def __init__(self, reason: Exception) -> None:
        folder = _state.get_diskcache_path()
        super().__init__(
            f"the cache {folder} cannot be used: {reason}. Remove the folder, or name another one "
            "in HEYOKA_CACHE_DIR."
        )


class CacheSize(NamedTuple):
    """The folder of the cache, the size of the code in it, and its limit, bytes."""

    folder: Path
    size: int
    limit: int


def set_cache_folder() -> None:
    """Set the folder and the limit of heyoka's cache for this process.

    If the folder cannot be used, nothing is cached; otherwise heyoka would print two warnings for
    every piece of code that it compiles.
    """
    parent = _state.get_diskcache_path()
    if parent == Path():
        # There is no home. The working folder is no place for a cache.
        _state.set_diskcache_enabled(False)
        return
    if parent.name != FOLDER:
        _state.set_diskcache_path(parent / FOLDER)
    try:
        # The limit is stored in the database. A smaller one was set by the user, so it stays.
        if _state.get_diskcache_limit() > LIMIT:
            _state.set_diskcache_limit(LIMIT)
    except (RuntimeError, ValueError, OSError):
        _state.set_diskcache_enabled(False)


def cache_size() -> CacheSize | None:
    """Return the folder and the size of the cache; None if there is none.

    Nothing is cached if the user has no home.

    Raises:
        CacheError: The database cannot be read.
    """
    if _state.get_diskcache_path() == Path():
        return None
    try:
        return CacheSize(
            _state.get_diskcache_path(), _state.get_diskcache_size(), _state.get_diskcache_limit()
        )
    except (RuntimeError, ValueError, OSError) as error:
        raise CacheError(error) from error


def clear_cache() -> None:
    """Remove all compiled code from the cache; other processes may use it meanwhile.

    Raises:
        CacheError: The database cannot be cleared.
    """
    folder = _state.get_diskcache_path()
    try:
        _state.clear_diskcache()
    except (RuntimeError, ValueError, OSError) as error:
        raise CacheError(error) from error
    # Setting a path closes the database. heyoka brings an SQLite of its own, and a process must not
    # open a database with two of them at a time.
    _state.set_diskcache_path(folder)
    with suppress(sqlite3.Error), closing(sqlite3.connect(folder / DATABASE)) as database:
        # Gives the space of the file back, unless another process is just using it.
        database.execute("VACUUM")
        database.execute("PRAGMA wal_checkpoint(TRUNCATE)")
