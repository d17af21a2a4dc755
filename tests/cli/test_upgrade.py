"""Protects `rbstab upgrade`: only `schema_version` changes, byte by byte; no file is damaged."""

import os
import shutil
import stat
from pathlib import Path

import pytest
from cli.conftest import GOOD, Invoke

from rbstab import load_config
from rbstab.config.load import resolved, run_id

ROOT = Path(__file__).parents[2] / "configs"
CONFIGS = sorted(path for path in ROOT.rglob("*.yaml") if path.parent.name != "sweeps")
PLANS = sorted((ROOT / "sweeps").glob("*.yaml"))

REST = """\
body: {mass: 41, inertia: [10.0, 9.0, 2.0], contact_point: [0.15, 0.10, -0.42]}
controller: {variant: free, K_t: [1, 1, 1], L_t: [1, 1, 1], K_r: [1, 1, 1], L_r: [1, 1, 1]}
integration: {duration: 0.1, samples: 11}
"""
INDENTED = "".join(f"  {line}\n" for line in REST.splitlines())
FLOW = ", ".join(REST.splitlines())
JSON = (
    '"body": {"mass": 41, "inertia": [10, 9, 2], "contact_point": [0, 0, 0]},\n'
    '  "controller": {"variant": "free", "K_t": [1, 1, 1], "L_t": [1, 1, 1], "K_r": [1, 1, 1],\n'
    '    "L_r": [1, 1, 1]},\n'
    '  "integration": {"duration": 1}'
)

BEGINNINGS = {
    "replaced": ("schema_version: 1\n", "schema_version: 2\n"),
    "added": ("", "schema_version: 2\n"),
    "added below a comment": ("# Mine\n\n", "# Mine\n\nschema_version: 2\n"),
    "with a comment": ("schema_version:   1   # old\n", "schema_version:   2   # old\n"),
    "another integer": ("schema_version: +01\n", "schema_version: 2\n"),
    "on a line of its own": ("schema_version:\n    1\n", "schema_version:\n    2\n"),
    "quoted key": ("'schema_version' : 1\n", "'schema_version' : 2\n"),
    "question mark": ("? schema_version\n: 1\n", "? schema_version\n: 2\n"),
    "document": ("---\n", "---\nschema_version: 2\n"),
    "directive": ("%YAML 1.2\n--- # x\n", "%YAML 1.2\n--- # x\nschema_version: 2\n"),
    "byte order mark": ("\ufeff", "\ufeffschema_version: 2\n"),
    "byte order mark, replaced": ("\ufeffschema_version: 1\n", "\ufeffschema_version: 2\n"),
    "other letters": ("# Ω 🙂\ntitle: 'ä 🙂'\n", "# Ω 🙂\nschema_version: 2\ntitle: 'ä 🙂'\n"),
    "line breaks of YAML": (
        "# a\x85# b\u2028schema_version: 1\n",
        "# a\x85# b\u2028schema_version: 2\n",
    ),
    "line breaks of YAML, added": ("# a\x85# b\u2029", "# a\x85# b\u2029schema_version: 2\n"),
}
"""What stands before the other keys, in version 1 and in version 2."""

WHOLE = {
    "last key": (f"{REST}schema_version: 1", f"{REST}schema_version: 2"),
    "end of a document": (f"{REST}...\n", f"schema_version: 2\n{REST}...\n"),
    "indented": (f"# x\n{INDENTED}", f"# x\n  schema_version: 2\n{INDENTED}"),
    "flow": (f"{{schema_version: 1, {FLOW}}}", f"{{schema_version: 2, {FLOW}}}"),
    "flow, last": (
        f"{{title: '🙂', {FLOW}, schema_version: 1}}",
        f"{{title: '🙂', {FLOW}, schema_version: 2}}",
    ),
    "flow, added": (f"{{ {FLOW}}}\n", f"{{ schema_version: 2, {FLOW}}}\n"),
    "flow in a document": (f"--- {{{FLOW}}}", f"--- {{schema_version: 2, {FLOW}}}"),
    "flow on lines": (f"{{ # x\n   {FLOW} }}", f"{{ # x\n   schema_version: 2,\n   {FLOW} }}"),
    "JSON": (f"{{\n  {JSON}\n}}\n", f'{{\n  "schema_version": 2,\n  {JSON}\n}}\n'),
    "JSON, replaced": (
        f'{{"schema_version":1,\n  {JSON}\n}}',
        f'{{"schema_version":2,\n  {JSON}\n}}',
    ),
}
"""Whole texts of version 1, and of version 2."""

TEXTS = {name: (old + REST, new + REST) for name, (old, new) in BEGINNINGS.items()} | WHOLE


def mine(text: str) -> Path:
    """Write a text byte by byte into `mine.yaml` of the working folder."""
    path = Path("mine.yaml")
    path.write_bytes(text.encode())
    return path


@pytest.mark.usefixtures("folder")
@pytest.mark.parametrize("line_break", ["\n", "\r\n", "\r"], ids=["LF", "CRLF", "CR"])
@pytest.mark.parametrize("name", TEXTS)
def test_nothing_else_changes(name: str, line_break: str, rbstab: Invoke) -> None:
    old, new = (text.replace("\n", line_break) for text in TEXTS[name])
    path = mine(old)
    done = rbstab("upgrade", "mine.yaml")
    assert (done.exit_code, done.stdout) == (0, "mine.yaml: schema_version 1 -> 2\n"), done.stderr
    assert path.read_bytes().decode() == new


@pytest.mark.parametrize("path", CONFIGS, ids=[str(path.relative_to(ROOT)) for path in CONFIGS])
def test_each_config_of_the_repository(path: Path, folder: Path, rbstab: Invoke) -> None:
    for beside in path.parent.glob("*.py"):
        shutil.copy(beside, folder)
    old = resolved_config(mine(path.read_text()))
    done = rbstab("upgrade", "mine.yaml")
    assert done.exit_code == 0
    new = resolved_config(Path("mine.yaml"))
    if old["schema_version"] == 2:
        assert done.stdout == "mine.yaml: schema_version 2 already, nothing to do\n"
        assert new == old
        return
    assert new.pop("elements") == {}
    assert new.pop("schema_version") == 2
    assert old.pop("schema_version") == 1
    assert new == old
    lines = Path("mine.yaml").read_text().splitlines()
    lines.remove("schema_version: 2")
    assert lines == path.read_text().splitlines()


def resolved_config(path: Path) -> dict[str, object]:
    """Return the resolved config of a file."""
    return resolved(load_config(path, allow_python=True))


def test_the_run_id_changes_as_the_help_says(folder: Path, rbstab: Invoke) -> None:
    before = run_id(load_config("good.yaml"))
    rbstab("upgrade", "good.yaml")
    assert run_id(load_config("good.yaml")) != before
    assert "run id then changes" in " ".join(rbstab("upgrade", "--help").stdout.split())


def test_elements_can_be_added_afterwards(folder: Path, rbstab: Invoke) -> None:
    element = "elements: {upright: {kind: attitude, K: [1, 1, 1], L: [1, 1, 1]}}\n"
    rbstab("upgrade", "good.yaml")
    Path("good.yaml").write_text(Path("good.yaml").read_text() + element)
    assert list(resolved_config(Path("good.yaml"))["elements"]) == ["upright"]  # type: ignore[call-overload]


def test_a_second_time_there_is_nothing_to_do(folder: Path, rbstab: Invoke) -> None:
    rbstab("upgrade", "good.yaml")
    before = (Path("good.yaml").read_bytes(), Path("good.yaml").stat().st_ino)
    done = rbstab("upgrade", "good.yaml")
    assert (done.exit_code, done.stderr) == (0, "")
    assert done.stdout == "good.yaml: schema_version 2 already, nothing to do\n"
    assert (Path("good.yaml").read_bytes(), Path("good.yaml").stat().st_ino) == before


@pytest.mark.parametrize(
    "wrong",
    [
        GOOD.replace("mass: 41", "mass: 0") + "colour: red\n",
        GOOD + "schema_version: 3\n",
        GOOD + "schema_version: '1'\n",
        GOOD + "schema_version:\n",
        GOOD + "schema_version: &one 1\n",
        GOOD + "schema_version: !!int 1\n",
        GOOD + "schema_version: 1\nschema_version: 1\n",
        GOOD + "---\n" + GOOD,
        GOOD + "elements: {up: {kind: attitude, K: [1, 1, 1], L: [1, 1, 1]}}\n",
        "{" + GOOD,
        "- 1\n",
        "",
    ],
    ids=repr,
)
def test_a_wrong_config_is_explained_as_by_check(wrong: str, folder: Path, rbstab: Invoke) -> None:
    mine(wrong)
    checked = rbstab("check", "good.yaml", "mine.yaml")
    done = rbstab("upgrade", "good.yaml", "mine.yaml")
    assert (done.exit_code, done.stdout) == (2, "")
    assert done.stderr == checked.stderr != ""
    # The other config is not upgraded either.
    assert Path("mine.yaml").read_bytes().decode() == wrong
    assert Path("good.yaml").read_text() == GOOD


@pytest.mark.usefixtures("folder")
def test_what_is_no_text_or_no_file(rbstab: Invoke) -> None:
    Path("mine.yaml").write_bytes(b"\xef\xbb\xbfa: \xff\n")
    done = rbstab("upgrade", "mine.yaml", "missing.yaml")
    assert done.exit_code == 2
    assert done.stderr == (
        "mine.yaml:1:4: is not text: byte 0xff (expected UTF-8)\n"
        "missing.yaml:1:1: cannot be read: No such file or directory (expected a YAML file; "
        "`rbstab init` writes a first one, `rbstab examples` lists others)\n"
    )


@pytest.mark.parametrize("plan", PLANS, ids=lambda path: path.stem)
def test_a_plan_is_refused(plan: Path, folder: Path, rbstab: Invoke) -> None:
    mine(plan.read_text())
    done = rbstab("upgrade", "mine.yaml")
    assert (done.exit_code, done.stdout) == (2, "")
    assert done.stderr == (
        "mine.yaml:1:1: is the plan of a sweep (expected a config; a plan keeps its own "
        "schema_version 1, and its base may have 2)\n"
    )
    assert Path("mine.yaml").read_text() == plan.read_text()


@pytest.mark.usefixtures("folder")
@pytest.mark.parametrize(
    "rewritten",
    [
        GOOD,
        "schema_version: 2\n" + GOOD.replace("mass: 41", "mass: 41.000000000000007"),
        "schema_version: 2\n" + GOOD.replace("A short run", "A long run"),
        "schema_version: 2\n" + GOOD.replace("initial: {angular_velocity: [1, 2, -1]}\n", ""),
        "schema_version: 2\n"
        + GOOD
        + "elements: {up: {kind: attitude, K: [1, 1, 1], L: [1, 1, 1]}}",
        "schema_version: 2\n" + GOOD + "colour: red\n",
        "{" + GOOD,
        "",
    ],
    ids=repr,
)
def test_a_text_with_another_meaning_is_never_written(
    rewritten: str, rbstab: Invoke, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("rbstab.config.writing.upgrade._rewritten", lambda *_: rewritten)
    done = rbstab("upgrade", "good.yaml")
    assert (done.exit_code, done.stdout) == (2, "")
    assert done.stderr == (
        "good.yaml:1:1: schema_version: cannot be changed without a change of anything else "
        "(expected schema_version: 1 in a line of its own)\n"
    )
    assert Path("good.yaml").read_text() == GOOD


@pytest.mark.usefixtures("folder")
def test_a_layout_that_cannot_be_rewritten_is_refused(rbstab: Invoke) -> None:
    text = f"! {{{FLOW}}}\n"
    mine(text)
    assert rbstab("check", "mine.yaml").exit_code == 0
    done = rbstab("upgrade", "mine.yaml")
    assert done.exit_code == 2
    assert "mine.yaml:1:1: schema_version: cannot be changed" in done.stderr
    assert Path("mine.yaml").read_text() == text


@pytest.mark.skipif(os.name != "posix", reason="other systems have no such permissions")
@pytest.mark.parametrize("mode", [0o600, 0o644, 0o664, 0o755])
def test_permissions_stay(mode: int, folder: Path, rbstab: Invoke) -> None:
    Path("good.yaml").chmod(mode)
    mask = os.umask(0o027)
    try:
        assert rbstab("upgrade", "good.yaml").exit_code == 0
    finally:
        os.umask(mask)
    assert stat.S_IMODE(Path("good.yaml").stat().st_mode) == mode


@pytest.mark.skipif(
    getattr(os, "geteuid", lambda: 1)() != 0, reason="only root may give files away"
)
def test_the_owner_stays(folder: Path, rbstab: Invoke) -> None:
    os.chown("good.yaml", 1234, 2345)
    assert rbstab("upgrade", "good.yaml").exit_code == 0
    status = Path("good.yaml").stat()
    assert (status.st_uid, status.st_gid) == (1234, 2345)


def test_a_link_stays_a_link(folder: Path, rbstab: Invoke) -> None:
    Path("inner").mkdir()
    Path("good.yaml").rename("inner/real.yaml")
    Path("good.yaml").symlink_to("inner/real.yaml")
    done = rbstab("upgrade", "good.yaml")
    assert done.stdout == "good.yaml: schema_version 1 -> 2\n"
    assert Path("good.yaml").is_symlink()
    assert Path("inner/real.yaml").read_text() == f"schema_version: 2\n{GOOD}"


def test_nothing_is_left_if_the_file_cannot_be_replaced(
    folder: Path, rbstab: Invoke, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fail(*_: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(Path, "replace", fail)
    done = rbstab("upgrade", "good.yaml")
    assert (done.exit_code, done.stdout) == (4, "")
    assert done.stderr.endswith("good.yaml: cannot be written: No space left on device\n")
    assert [path.name for path in folder.iterdir()] == ["good.yaml"]
    assert Path("good.yaml").read_text() == GOOD


def test_a_write_protected_file_is_left(
    folder: Path, rbstab: Invoke, monkeypatch: pytest.MonkeyPatch
) -> None:
    mine(GOOD)
    # The system lets root write everything, so the answer is given here.
    access = os.access
    monkeypatch.setattr(
        os, "access", lambda p, mode: access(p, mode) and (mode, Path(p).stem) != (os.W_OK, "mine")
    )
    done = rbstab("upgrade", "good.yaml", "mine.yaml")
    assert (done.exit_code, done.stdout) == (4, "")
    assert done.stderr.endswith("mine.yaml cannot be written: it is write-protected\n")
    assert Path("good.yaml").read_text() == Path("mine.yaml").read_text() == GOOD


def test_a_copy(folder: Path, rbstab: Invoke) -> None:
    done = rbstab("upgrade", "good.yaml", "-o", "new.yaml")
    assert (done.exit_code, done.stderr) == (0, "")
    assert done.stdout == "good.yaml: schema_version 1 -> 2, in new.yaml\n"
    assert Path("good.yaml").read_text() == GOOD
    assert Path("new.yaml").read_text() == f"schema_version: 2\n{GOOD}"
    again = rbstab("upgrade", "new.yaml", "-o", "newer.yaml")
    assert again.stdout == "new.yaml: schema_version 2 already, nothing to do; nothing is written\n"
    assert not Path("newer.yaml").exists()


def test_a_copy_replaces_no_other_file(folder: Path, rbstab: Invoke) -> None:
    Path("new.yaml").write_text("precious")
    done = rbstab("upgrade", "good.yaml", "-o", "new.yaml")
    assert (done.exit_code, done.stdout) == (4, "")
    assert done.stderr == "new.yaml: already exists. Replace it with --force.\n"
    assert Path("new.yaml").read_text() == "precious"
    assert rbstab("upgrade", "good.yaml", "-o", "new.yaml", "--force").exit_code == 0
    assert Path("new.yaml").read_text() == f"schema_version: 2\n{GOOD}"


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (("good.yaml", "--force"), "--force has no effect without -o."),
        (("good.yaml", "a.yaml", "-o", "b.yaml"), "-o names one file, so it needs a single CONFIG"),
        (("good.yaml", "-o", "./good.yaml"), "good.yaml is the given config."),
    ],
    ids=["force", "several", "itself"],
)
def test_options_that_do_not_fit(
    options: tuple[str, ...], message: str, folder: Path, rbstab: Invoke
) -> None:
    done = rbstab("upgrade", *options)
    assert done.exit_code == 2
    assert message in done.stderr
    assert Path("good.yaml").read_text() == GOOD
    assert [path.name for path in folder.iterdir()] == ["good.yaml"]
