"""Protects reading results that something else holds open in the same process: h5py with any way of
locking, xarray with either engine. A file that is open for writing is not called damaged.
"""

from collections.abc import Callable
from contextlib import AbstractContextManager, closing
from pathlib import Path
from shutil import copytree
from typing import Any

import h5py
import netCDF4
import pytest
import xarray
from support.results import assert_equal, result

import rbstab
from rbstab.store.errors import NotAResultError, StoreError
from rbstab.store.run_file import write_result

SWEEP = Path(__file__).parents[1] / "formats/data/0.1.0/sweeps/finished_variants"

HOLDERS: dict[str, Callable[[Path], AbstractContextManager[Any]]] = {
    "h5py": lambda path: h5py.File(path, "r"),
    "h5py, locked": lambda path: h5py.File(path, "r", locking=True),
    "h5py, not locked": lambda path: h5py.File(path, "r", locking=False),
    "h5py, best effort": lambda path: h5py.File(path, "r", locking="best-effort"),
    "h5py, single writer": lambda path: h5py.File(path, "r", libver="latest", swmr=True),
    "xarray, h5netcdf": lambda path: xarray.open_dataset(path, engine="h5netcdf"),
    "xarray, netCDF4": lambda path: xarray.open_dataset(path, engine="netcdf4"),
    "netCDF4": lambda path: closing(netCDF4.Dataset(path)),
}


@pytest.mark.parametrize("holder", HOLDERS)
def test_a_run(holder: str, tmp_path: Path) -> None:
    path = tmp_path / "a.h5"
    write_result(path, result())
    with HOLDERS[holder](path):
        assert_equal(rbstab.open_result(path), result())
    # Reading leaves nothing open: any way of locking is possible afterwards.
    with HOLDERS[holder](path):
        pass


@pytest.mark.parametrize("holder", HOLDERS)
def test_a_sweep_and_its_traces(holder: str, tmp_path: Path) -> None:
    folder = tmp_path / "sweep"
    copytree(SWEEP, folder)
    traces = sorted((folder / "traces").glob("*.h5"))[0]
    with HOLDERS[holder](folder / "sweep.h5"), HOLDERS[holder](traces):
        assert len(rbstab.open_sweep(folder)["status"]) > 0
        assert len(list(rbstab.open_traces(folder))) > 0


@pytest.mark.parametrize("mode", ["r+", "a"])
@pytest.mark.parametrize("libver", [None, "latest"])
def test_a_run_that_is_open_for_writing(mode: str, libver: str | None, tmp_path: Path) -> None:
    path = tmp_path / "a.h5"
    write_result(path, result())
    with h5py.File(path, mode, libver=libver):
        with pytest.raises(StoreError, match="is open for writing") as caught:
            rbstab.open_result(path)
        assert not isinstance(caught.value, NotAResultError)
    assert_equal(rbstab.open_result(path), result())


def test_a_run_that_was_changed(tmp_path: Path) -> None:
    path = tmp_path / "a.h5"
    write_result(path, result())
    for places in ([-1000], [20, -1000]):
        content = bytearray(path.read_bytes())
        for place in places:
            content[place] ^= 1
        (tmp_path / "changed.h5").write_bytes(content)
        with pytest.raises(NotAResultError, match="is damaged"):
            rbstab.open_result(tmp_path / "changed.h5")


@pytest.mark.parametrize("size", [0, 8, 12, 21, 23])
def test_a_short_file_is_damaged(size: int, tmp_path: Path) -> None:
    path = tmp_path / "a.h5"
    write_result(path, result())
    content = path.read_bytes()
    path.write_bytes(content[:size] + content[-80:])
    with pytest.raises(NotAResultError, match="is damaged"):
        rbstab.open_result(path)
