"""Protects the commands that messages name: a shell of the system reads each word back."""

import shlex
import sys

import pytest
from support.printed_paths import read_by_windows

from rbstab.files.text import chained_commands, quoted, shell_word

NAMES = ["results/a.h5", "my results/a.h5", "it's", "a&b", "a;b", "$HOME", "größe", "-o", "a(b)"]


@pytest.mark.parametrize("name", NAMES)
def test_posix(name, monkeypatch):
    monkeypatch.setattr(sys, "platform", "linux")
    (word,) = shlex.split(shell_word(name))
    assert word == (f"./{name}" if name.startswith("-") else name)


@pytest.mark.parametrize("name", [*NAMES, r"results\a.h5", r"C:\my results\a.h5", r"\\host\a b"])
def test_windows(name, monkeypatch):
    monkeypatch.setattr(sys, "platform", "win32")
    written = shell_word(name)
    assert read_by_windows(written) == [f"./{name}" if name.startswith("-") else name]
    assert "'" not in written.replace(name, "")
    # Outside double quotes, `cmd` acts on these.
    assert written.startswith('"') or not set(written) & set("&|<>^()%!;, '")


@pytest.mark.parametrize(("path", "word"), [(r"results\a.h5", r"results\a.h5"), ("a b", '"a b"')])
def test_words_of_windows(path, word, monkeypatch):
    monkeypatch.setattr(sys, "platform", "win32")
    assert shell_word(path) == word


TITLES = ['the "best" gains', "plain", "two words", "two words\\", 'a\\"b c\\\\', ""]


@pytest.mark.parametrize("title", TITLES)
def test_titles_on_windows(title, monkeypatch):
    monkeypatch.setattr(sys, "platform", "win32")
    assert read_by_windows(quoted(title)) == [title]


def test_two_commands(monkeypatch):
    monkeypatch.setattr(sys, "platform", "linux")
    assert chained_commands("cd 'my own'", "rbstab run x") == "cd 'my own' && rbstab run x"
    # `&&` is an error in the PowerShell of Windows, and `;` in `cmd`.
    monkeypatch.setattr(sys, "platform", "win32")
    assert chained_commands('cd "my own"', "rbstab run x") == 'cd "my own", then rbstab run x'
