"""Build the library that makes system calls fail, and tell it which calls fail."""

import errno
import mmap
import os
import shutil
import struct
import subprocess
import sys
from pathlib import Path
from typing import NamedTuple

SOURCE = Path(__file__).with_name("fail_calls.c")

COMPILER = next(filter(None, map(shutil.which, ("cc", "gcc", "clang"))), None)

CAN_BUILD = COMPILER is not None and sys.platform == "linux"
"""Whether the library can be built and loaded here."""

CONTROL = "FAIL_CALLS"
"""The environment variable with the name of the control file."""

_CALLS = (
    *("open", "write", "pwrite", "close", "fsync", "rename", "link"),
    *("ftruncate", "flock", "unlink", "mkdir", "read", "create"),
)
"""The system calls, in the order of their bits in the control file."""

OPERATIONS = {
    **{name: (name,) for name in _CALLS if name != "create"},
    # Everything that needs space: from one call on, the disk is full.
    "space": ("create", "write", "pwrite", "ftruncate", "mkdir"),
}
"""The system calls of each operation."""

SHORT = "short"
"""The name of the fault in which only half of the bytes are written or read."""

_LAYOUT = struct.Struct("6I1024s1024s")


class Fault(NamedTuple):
    """A call that fails.

    Args:
        operation: A key of `OPERATIONS`.
        error: EIO, ENOSPC or another name of `errno`, or `SHORT`.
        nth: The number of the call, from 1, over all processes.
        lasting: Whether all later calls of the operation fail too.
    """

    operation: str
    error: str
    nth: int
    lasting: bool

    def __str__(self):
        lasting = " and later" if self.lasting else ""
        return f"{self.operation} {self.nth}{lasting}: {self.error}"


class Counts(NamedTuple):
    """What the library did.

    Args:
        calls: Calls of the operation on files in the folder.
        faults: Calls of these that failed.
        first: The function and the path of the first call that failed.
    """

    calls: int
    faults: int
    first: str


class Control:
    """The control file of the library, which all processes that load it share.

    Args:
        path: The file; it must exist.
    """

    def __init__(self, path):
        with path.open("r+b") as file:
            self._memory = mmap.mmap(file.fileno(), _LAYOUT.size)

    def arm(self, folder, fault):
        """Let a call on files in a folder fail; with `nth` = 0 calls are only counted."""
        bits = sum(1 << _CALLS.index(name) for name in OPERATIONS[fault.operation])
        error = 0 if fault.error == SHORT else getattr(errno, fault.error)
        numbers = bits, error, fault.nth, int(fault.lasting), 0, 0
        _LAYOUT.pack_into(self._memory, 0, *numbers, os.fsencode(folder.resolve()), b"")

    def disarm(self):
        """Let all calls pass, and return what was counted."""
        *_, calls, faults, _folder, first = _LAYOUT.unpack_from(self._memory)
        _LAYOUT.pack_into(self._memory, 0, *(0,) * 6, b"", b"")
        return Counts(calls, faults, first.rstrip(b"\0").decode(errors="replace"))


def build(folder):
    """Build the library and its control file; return the environment variables that load it."""
    assert COMPILER is not None
    library, control = folder / "fail_calls.so", folder / "control"
    subprocess.run(
        [COMPILER, "-shared", "-fPIC", "-O1", "-o", library, SOURCE, "-ldl"],
        check=True,
        timeout=60,
    )
    control.write_bytes(bytes(_LAYOUT.size))
    return {"LD_PRELOAD": str(library), CONTROL: str(control)}
