"""Protects the cache of compiled code on the disk: its place, its limit, and a folder that cannot
be used. Each test asks a process of its own, because heyoka's settings hold for a whole process.
"""

import os
import subprocess
import sys
from pathlib import Path

import pytest

hy = pytest.importorskip("heyoka")
if not hasattr(hy.llvm_state, "set_diskcache_path"):
    pytest.skip("this heyoka has no cache on the disk", allow_module_level=True)

COMPILE = """
import heyoka as hy
x, y = hy.make_vars("x", "y")
def compile_code(number):
    return hy.cfunc([hy.sin(x) + number * y], [x, y])
"""


def asked(code, **variables):
    """Return the lines that a new process prints; of the variables of places only these are set."""
    others = {"HOME", "XDG_CACHE_HOME", "HEYOKA_CACHE_DIR", "LOCALAPPDATA"}
    kept = {name: value for name, value in os.environ.items() if name not in others}
    done = subprocess.run(
        [sys.executable, "-c", code],
        env=kept | variables,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        check=True,
    )
    return done.stdout.splitlines()


@pytest.mark.skipif(sys.platform != "linux", reason="the cache folder of Linux")
@pytest.mark.parametrize("variable", ["HOME", "XDG_CACHE_HOME", "HEYOKA_CACHE_DIR"])
def test_the_code_is_kept_in_a_folder_of_its_own(variable, tmp_path):
    code = f"import rbstab.integrate.heyoka\n{COMPILE}\ncompile_code(1)"
    assert asked(code, **{variable: str(tmp_path)}) == []
    inside = {"HOME": ".cache/heyoka", "XDG_CACHE_HOME": "heyoka", "HEYOKA_CACHE_DIR": "."}
    caches = sorted(path.relative_to(tmp_path) for path in tmp_path.rglob("cache.db"))
    assert caches == [Path(inside[variable]) / "rbstab/cache.db"]


def test_the_limit_is_200_mb(tmp_path):
    code = (
        "import heyoka as hy\nimport rbstab.integrate.heyoka\n"
        "print(hy.llvm_state.get_diskcache_limit())"
    )
    assert asked(code, HEYOKA_CACHE_DIR=str(tmp_path)) == ["200000000"]


def test_a_smaller_limit_of_the_user_stays(tmp_path):
    code = (
        "import heyoka as hy\nimport rbstab.integrate.heyoka\n"
        "print(hy.llvm_state.get_diskcache_limit())\nhy.llvm_state.set_diskcache_limit(1000)"
    )
    asked(code, HEYOKA_CACHE_DIR=str(tmp_path))
    assert asked(code, HEYOKA_CACHE_DIR=str(tmp_path)) == ["1000"]


def test_the_cache_never_grows_above_its_limit(tmp_path):
    code = (
        "import rbstab.integrate.heyoka.compile_cache as cache\n"
        f"{COMPILE}\n"
        "sizes = []\n"
        "for number in range(1, 5):\n"
        "    compile_code(number)\n"
        "    sizes.append(cache.cache_size().size)\n"
        "cache.LIMIT = sizes[1]\n"
        "cache.set_cache_folder()\n"
        "for number in range(5, 9):\n"
        "    compile_code(number)\n"
        "    assert 0 < cache.cache_size().size <= cache.LIMIT\n"
        "print(sizes[3] > sizes[1] > 0)"
    )
    assert asked(code, HEYOKA_CACHE_DIR=str(tmp_path)) == ["True"]


def test_a_folder_that_cannot_be_used_means_no_cache_and_no_warnings():
    code = f"import rbstab.integrate.heyoka\n{COMPILE}\nprint(compile_code(2)([0.0, 3.0]))"
    assert asked(code, HEYOKA_CACHE_DIR=f"{os.devnull}/cache") == ["[6.]"]


@pytest.mark.skipif(sys.platform != "linux", reason="the variables of Linux")
def test_without_a_home_nothing_is_cached(tmp_path):
    code = (
        f"import os\nos.chdir({str(tmp_path)!r})\n"
        f"import rbstab.integrate.heyoka\n{COMPILE}\nprint(compile_code(2)([0.0, 3.0]))"
    )
    assert asked(code) == ["[6.]"]
    assert list(tmp_path.iterdir()) == []
