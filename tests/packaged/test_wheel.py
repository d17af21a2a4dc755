"""Protects `pip install` of the wheel alone: it carries all examples, and leads to a first report,
with and without heyoka.
"""

import importlib.util
import os
import shutil
import subprocess
import sys
import sysconfig
import zipfile
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]

pytestmark = pytest.mark.heavy

NO_PACKAGE_INDEX = ("No matching distribution", "Could not find a version", "Connection")
"""What pip prints if it needs a package index that cannot be reached."""

NO_HEYOKA = 'raise ImportError("this machine has no heyoka")\n'


@pytest.fixture(scope="module")
def wheel(tmp_path_factory):
    """The wheel of the project, built by its build backend."""
    folder = tmp_path_factory.mktemp("wheel")
    here = importlib.util.find_spec("hatchling") is not None
    isolation = ["--no-build-isolation"] if here else []
    words = [sys.executable, "-m", "pip", "wheel", "--no-deps", "--quiet", *isolation]
    words += ["-w", str(folder), str(ROOT)]
    done = subprocess.run(words, capture_output=True, text=True, check=False)
    if not here and any(text in done.stderr for text in NO_PACKAGE_INDEX):
        pytest.skip("hatchling is not installed, and no package index can be reached")
    assert done.returncode == 0, done.stderr
    (path,) = folder.glob("rbstab-*.whl")
    return path


class Installation:
    """A new environment with the wheel.

    Args:
        folder: The folder of the environment.
    """

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        """The working folder."""
        subprocess.run([sys.executable, "-m", "venv", "--without-pip", folder], check=True)
        self.scripts = folder / ("Scripts" if sys.platform == "win32" else "bin")
        code = "import sysconfig; print(sysconfig.get_path('purelib'))"
        self.packages = Path(self.call("python", "-c", code).strip())

    def install(self, wheel: Path) -> None:
        """Install the wheel alone; the dependencies are those of the environment of the tests."""
        call = [sys.executable, "-m", "pip", "--python", str(self.scripts / "python"), "install"]
        words = ("--quiet", "--disable-pip-version-check", "--no-deps", "--no-index", str(wheel))
        subprocess.run([*call, *words], check=True)
        # A line of a .pth file adds a folder, but does not read the .pth files in it: so the
        # editable rbstab of this environment is not found.
        (self.packages / "dependencies.pth").write_text(sysconfig.get_path("purelib") + "\n")

    def has_heyoka(self) -> bool:
        """Return whether heyoka can be imported."""
        code = "try:\n  import heyoka\n  print(1)\nexcept ImportError:\n  print(0)"
        return self.call("python", "-c", code).strip() == "1"

    def call(self, name: str, *arguments: str) -> str:
        environment = {k: v for k, v in os.environ.items() if k != "PYTHONPATH"}
        done = subprocess.run(
            [str(self.scripts / name), *arguments],
            cwd=self.folder,
            env=environment,
            capture_output=True,
            text=True,
            check=False,
        )
        assert done.returncode == 0, f"{arguments}\n{done.stdout}{done.stderr}"
        return done.stdout + done.stderr


@pytest.fixture(scope="module")
def environment(wheel, tmp_path_factory):
    """A new environment with the wheel. The workflow tests it with each version of Python."""
    made = Installation(tmp_path_factory.mktemp("environment"))
    made.install(wheel)
    return made


@pytest.fixture(scope="module", params=["with heyoka", "without heyoka"])
def installed(
    request,
    environment,
    tmp_path_factory,
):
    """The environment and an empty folder, with heyoka if this system has it, and without."""
    environment.folder = tmp_path_factory.mktemp("work")
    stub = environment.packages / "heyoka" / "__init__.py"
    hidden = stub.parent.with_name("hidden_heyoka")
    if request.param == "with heyoka":
        yield environment
        return
    had_heyoka = stub.parent.exists()
    if had_heyoka:
        stub.parent.rename(hidden)
    stub.parent.mkdir()
    stub.write_text(NO_HEYOKA)
    assert not environment.has_heyoka()
    yield environment
    shutil.rmtree(stub.parent)
    if had_heyoka:
        hidden.rename(stub.parent)


def test_the_wheel_carries_all_examples(wheel):
    folder = "rbstab/configs/"
    with zipfile.ZipFile(wheel) as archive:
        carried = {
            name.removeprefix(folder): archive.read(name)
            for name in archive.namelist()
            if name.startswith(folder)
        }
    files = [path for path in (ROOT / "configs").rglob("*") if path.is_file()]
    expected = {path.relative_to(ROOT / "configs").as_posix(): path for path in files}
    assert {name: path.read_bytes() for name, path in expected.items()} == carried


def test_it_leads_to_a_first_report(installed):
    where = installed.call("python", "-c", "import rbstab; print(rbstab.__file__)")
    assert Path(where.strip()).is_relative_to(installed.packages)
    installed.call("rbstab", "examples", "case2_visco_elastic")
    installed.call("rbstab", "run", "configs/paper/case2_visco_elastic.yaml")
    shown = installed.call("rbstab", "report", "results/case2_visco_elastic.h5", "--format=text")
    assert "Case 2, visco-elastic connection" in shown
    installed.call("rbstab", "init", "first")
    installed.call("rbstab", "run", "first/experiment.yaml")
    installed.call("rbstab", "report", "results/experiment.h5", "-o", "report.html")
    assert (installed.folder / "report.html").stat().st_size > 100_000


def test_examples_and_sweeps_from_python(installed):
    code = "import rbstab; print(rbstab.simulate(rbstab.example('case1_permanent')).status)"
    assert installed.call("python", "-c", code) == "completed\n"
    (installed.folder / "few.yaml").write_text(
        "base: configs/paper/case1_permanent.yaml\nvary: {body.mass: {values: [40, 41]}}\n"
    )
    installed.call("rbstab", "examples", "case1_permanent")
    printed = installed.call("rbstab", "sweep", "few.yaml")
    assert "completed 2 100.00%" in " ".join(printed.split())
    assert ("heyoka is not installed" in printed) == (not installed.has_heyoka())
