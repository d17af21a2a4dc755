"""Protects `rbstab cache`: what it prints, that it clears the cache, and its exit codes."""

import os
import subprocess
import sys

import pytest

hy = pytest.importorskip("heyoka")
if not hasattr(hy.llvm_state, "set_diskcache_path"):
    pytest.skip("this heyoka has no cache on the disk", allow_module_level=True)

FILL = """
import rbstab.integrate.heyoka, heyoka as hy
x, y = hy.make_vars("x", "y")
for number in range(40):
    hy.cfunc([hy.sin(number * x) + y], [x, y])
"""


def called(*arguments, folder):
    """Call Python in a process of its own, with the cache in a folder."""
    return subprocess.run(
        [sys.executable, *arguments],
        env=os.environ | {"HEYOKA_CACHE_DIR": str(folder)},
        capture_output=True,
        text=True,
        check=False,
    )


def cache(*options, folder):
    """Call `rbstab cache`."""
    return called("-m", "rbstab_cli", "cache", *options, folder=folder)


def test_the_cache_is_shown_and_cleared(tmp_path):
    place = tmp_path / "rbstab"
    assert cache(folder=tmp_path).stdout == f"{place}: 0.0 MB of at most 200 MB\n"
    assert called("-c", FILL, folder=tmp_path).returncode == 0
    full = (place / "cache.db").stat().st_size
    size = cache(folder=tmp_path).stdout.removeprefix(f"{place}: ").partition(" MB")[0]
    assert 0.1 < float(size) <= full / 1e6
    done = cache("--clear", folder=tmp_path)
    assert (done.returncode, done.stdout) == (0, f"{place}: removed {size} MB\n")
    assert cache(folder=tmp_path).stdout == f"{place}: 0.0 MB of at most 200 MB\n"
    assert sum(path.stat().st_size for path in place.iterdir()) < full / 4


@pytest.mark.parametrize("options", [(), ("--clear",)])
def test_a_folder_that_cannot_be_used_is_an_error(options):
    folder = f"{os.devnull}/cache"
    done = cache(*options, folder=folder)
    assert (done.returncode, done.stdout) == (4, "")
    assert done.stderr.startswith(f"error: the cache {folder}/rbstab cannot be used: ")
    assert done.stderr.endswith("HEYOKA_CACHE_DIR.\n")
