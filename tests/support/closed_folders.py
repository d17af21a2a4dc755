"""Folders that may not be entered, for users who may enter all: the errors are imitated."""

import errno
import os
from pathlib import Path


def close(folder, monkeypatch):
    """Make a folder look as if it may be neither listed nor entered; its own status is known."""
    closed = folder.absolute()

    def guarded(function, *, itself):
        def call(path, *arguments, **options):
            if isinstance(path, str | os.PathLike):
                whole = Path(path).absolute()
                if closed in whole.parents or (itself and whole == closed):
                    raise PermissionError(errno.EACCES, os.strerror(errno.EACCES), str(path))
            return function(path, *arguments, **options)

        return call

    for name, itself in (("stat", False), ("open", True), ("listdir", True), ("scandir", True)):
        monkeypatch.setattr(os, name, guarded(getattr(os, name), itself=itself))
