"""Protects the documentation site: it builds without a warning, its links lead somewhere, and what
is made from the program is complete: functions, commands, gallery, drawing, numbers of members.
"""

import re
import subprocess
import sys

import pytest
import yaml
from support.documents import DOCS, FIGURES, ROOT, assert_same_drawing, blocks_of, page, script

import rbstab
from rbstab_cli.registry import COMMANDS

BUILT_WITH = ("sphinx", "myst_parser", "furo", "sphinx_copybutton")


@pytest.fixture(scope="module")
def site(tmp_path_factory):
    """The site, built as by `make docs`."""
    for name in BUILT_WITH:
        pytest.importorskip(name)
    folder = tmp_path_factory.mktemp("site")
    options = ["-q", "-W", "--keep-going", "-d", str(folder / "doctrees"), "-b", "html"]
    done = subprocess.run(
        [sys.executable, "-m", "sphinx", *options, str(DOCS), str(folder / "html")],
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    return folder / "html"


@pytest.mark.heavy
def test_links_inside_the_site_lead_somewhere(site):
    links = script(DOCS / "site_links.py")
    assert links.broken(site) == []
    page = site / "new.html"
    page.write_text('<a href="nowhere.html">a</a><a href="index.html#nothing">b</a>')
    assert links.broken(site) == ["new.html: index.html#nothing", "new.html: nowhere.html"]


@pytest.mark.heavy
def test_each_page_is_on_the_site(site):
    built = {path.stem for path in site.glob("*.html")}
    assert {path.stem for path in DOCS.glob("*.md")} <= built
    text = (site / "commands.html").read_text(encoding="utf-8")
    for name in COMMANDS:
        assert f'id="rbstab-{name}"' in text
    assert "--prove" in text  # not a dash


def test_each_public_name_is_in_the_api_once():
    text = page("api")
    names = re.findall(r"\.\. auto(?:function|class|exception):: rbstab\.(\w+)$", text, re.M)
    assert sorted(names) == sorted(rbstab.__all__)


@pytest.mark.parametrize("name", rbstab.__all__)
def test_each_public_name_has_a_docstring(name):
    assert len(getattr(rbstab, name).__doc__ or "") > 20


def test_the_gallery_has_each_config_with_its_picture():
    gallery, text = script(FIGURES / "gallery.py"), page("gallery")
    assert gallery.filled(text) == text, "run docs/figures/gallery.py with the names of new configs"
    shown = {path.stem for part in gallery.SHOWN_CONFIGS for path in gallery.configs(part)}
    assert {path.stem for path in (DOCS / "pictures/gallery").glob("*.png")} == shown


def test_pictures_are_small():
    for path in (DOCS / "pictures").rglob("*.*"):
        assert path.stat().st_size < 60_000, path


def test_the_gallery_counts_the_members_of_each_plan():
    rows = re.findall(
        r"^\| \[(\w+)\]\(\.\./configs/sweeps/\1\.yaml\) .*\| ([\d,]+) \|$", page("gallery"), re.M
    )
    plans = {path.stem for path in (ROOT / "configs/sweeps").glob("*.yaml")}
    assert {name for name, _ in rows} == plans
    for name, members in rows:
        plan = rbstab.load_plan(ROOT / f"configs/sweeps/{name}.yaml", allow_python=True)
        assert plan.members == int(members.replace(",", "")), name


@pytest.mark.parametrize("name", ["system", "angles"])
def test_the_drawing_is_that_of_the_program(name):
    done = subprocess.run(
        [sys.executable, str(FIGURES / f"{name}.py"), "-"],
        capture_output=True,
        encoding="utf-8",
        check=True,
    )
    assert_same_drawing(DOCS / "pictures" / f"{name}.svg", done.stdout)


def test_the_citation_has_the_version():
    citation = yaml.safe_load((ROOT / "CITATION.cff").read_text(encoding="utf-8"))
    assert f'version = "{citation["version"]}"' in (ROOT / "pyproject.toml").read_text()
    assert citation["license"] in (ROOT / "README.md").read_text(encoding="utf-8")


def test_the_tutorials_use_one_box():
    """Numbers of one tutorial are used in the others."""
    pages = ["tutorial_first", "tutorial_stable", "tutorial_sweep", "choosing"]
    blocks = [blocks_of(page(name), "yaml") for name in pages]
    boxes = [[text for text in texts if text.startswith("# box.yaml")] for texts in blocks]
    assert all(len(of_page) == 1 for of_page in boxes)
    configs = [rbstab.load_config(yaml.safe_load(text)) for (text,) in boxes]
    assert all(config == configs[0] for config in configs)


def test_each_fenced_block_is_closed_and_not_indented():
    """Others are not executed: see `support/page_sessions.py`."""
    for path in [*DOCS.glob("*.md"), ROOT / "README.md", ROOT / "results/README.md"]:
        text = path.read_text(encoding="utf-8")
        assert not re.search(r"^[ >]+```", text, re.M), path
        assert len(re.findall(r"^```", text, re.M)) % 2 == 0, path


def test_the_workflow_tests_each_system_and_the_oldest_dependencies():
    workflow = yaml.safe_load((ROOT / ".github/workflows/tests.yml").read_text(encoding="utf-8"))
    systems = workflow["jobs"]["systems"]["strategy"]["matrix"]
    assert {name.split("-")[0] for name in systems["os"]} == {"ubuntu", "macos", "windows"}
    oldest = str(workflow["jobs"]["oldest"]["steps"])
    assert "--constraint .github/oldest.txt" in oldest
    (floor,) = re.findall(r'requires-python = ">=([\d.]+)"', (ROOT / "pyproject.toml").read_text())
    assert floor in systems["python"]
    assert f"'{floor}'" in oldest
