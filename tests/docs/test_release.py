"""A release is made of a tag only if everything that states a version agrees with it."""

import pytest
from support.release import notes, problems

PROJECT = '[project]\nname = "rbstab"\nversion = "1.2.0"\n'
CITATION = "title: rbstab\nversion: 1.2.0\ndate-released: 2027-01-31\n"
CHANGES = """# Changelog

## Unreleased

- Not in this release.

## 1.2.0, 2027-01-31

- First change.
- Second change.

## 1.1.0, 2026-12-24

- Older change.
"""


@pytest.fixture
def root(tmp_path):
    (tmp_path / "pyproject.toml").write_text(PROJECT, encoding="utf-8")
    (tmp_path / "CITATION.cff").write_text(CITATION, encoding="utf-8")
    (tmp_path / "CHANGELOG.md").write_text(CHANGES, encoding="utf-8")
    return tmp_path


def test_a_tag_with_its_version_is_released_with_its_notes(root):
    assert problems("v1.2.0", root) == []
    assert notes("v1.2.0", root) == "- First change.\n- Second change."


@pytest.mark.parametrize(
    ("tag", "count", "words"),
    [
        ("1.2.0", 1, "does not begin with v"),
        ("v1.3.0", 3, "pyproject.toml has version 1.2.0, and the tag is v1.3.0"),
        ("v1.1.0", 2, "CITATION.cff has version 1.2.0"),
        ("v1.2", 3, "no section 1.2 "),
    ],
)
def test_a_tag_of_another_version_is_refused(tag, count, words, root):
    messages = problems(tag, root)
    assert len(messages) == count
    assert words in " ".join(messages)


@pytest.mark.parametrize(
    ("file", "old", "new", "words"),
    [
        ("CITATION.cff", "date-released: 2027-01-31\n", "", "no date-released"),
        ("CHANGELOG.md", "- First change.\n- Second change.\n", "", "no section 1.2.0"),
        ("CHANGELOG.md", "## 1.2.0, 2027-01-31", "## Soon", "no section 1.2.0"),
    ],
)
def test_an_incomplete_release_is_refused(file, old, new, words, root):
    text = (root / file).read_text(encoding="utf-8")
    assert old in text
    (root / file).write_text(text.replace(old, new), encoding="utf-8")
    (message,) = problems("v1.2.0", root)
    assert words in message
