"""Small file systems in memory, which another process fills while a command runs."""

import shutil
import subprocess
from contextlib import contextmanager, suppress
from pathlib import Path

import pytest
from support.forked_commands import CommandServer, wait_until

BLOCKS = 1 << 20, 1 << 12
"""Bytes of the writes that fill a disk: at first fast, then to the last page."""

PLENTY = 1 << 28
"""Bytes; more than any command of the tests writes."""

NAMESPACES = (("unshare", "--map-root-user", "--mount"), ("unshare", "--mount"))
"""Commands that give a process its own mounts: for any user where the system allows it, or root."""


class SmallDisk:
    """A file system in memory, which only a server and its commands have mounted.

    Args:
        server: Runs in its own mount namespace.
        folder: An empty folder, where the server mounts the file system.
    """

    def __init__(self, server, folder):
        self.server = server
        self.inside = folder
        """The folder as the server and its commands see it."""
        self.path = Path(f"/proc/{server.pid}/root{folder}")
        """The folder as this process sees it."""
        self._filler = self.path / "filler"

    def mount(self, size):
        """Mount it empty, with so many bytes."""
        assert self.server.ask("mount", str(self.inside), size) == "0"

    def unmount(self):
        """Unmount it; its files are lost."""
        # A worker of a command that has ended may still be in the folder for a moment.
        assert wait_until(lambda: self.server.ask("unmount", str(self.inside)) == "0", 10.0)

    def resize(self, size):
        """Change its size, which must be enough for its files."""
        assert self.server.ask("resize", str(self.inside), size) == "0"

    @property
    def used(self):
        """The bytes of its files and folders."""
        return shutil.disk_usage(self.path).used

    def fill(self):
        """Write until the disk is full."""
        with self._filler.open("ab", buffering=0) as file:
            for size in BLOCKS:
                with suppress(OSError):
                    while file.write(bytes(size)):
                        pass

    def free(self):
        """Remove what `fill` has written, and make the disk large."""
        self._filler.unlink(missing_ok=True)
        self.resize(PLENTY)


@contextmanager
def small_disk(folder):
    """Yield a disk that is not mounted yet; skip the test where nothing can be mounted."""
    mounted = folder / "disk"
    mounted.mkdir(parents=True)
    namespace = next((words for words in NAMESPACES if _can_mount(words, mounted)), None)
    if namespace is None:
        pytest.skip("no file system can be mounted here: neither in a user namespace nor as root")
    with CommandServer(folder, namespace) as server:
        yield SmallDisk(server, mounted)


def _can_mount(namespace, folder):
    command = (*namespace, "mount", "-t", "tmpfs", "rbstab-test", str(folder))
    try:
        return subprocess.run(command, capture_output=True, check=False).returncode == 0
    except OSError:
        return False
