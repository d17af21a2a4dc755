"""Protects the pages of the documentation: their commands and snippets run, and print what the
pages show.
"""

import pytest
from support.page_sessions import (
    NOT_EXECUTED,
    PREPARED,
    ROOT,
    blocks,
    commands,
    differences_of,
    pages,
    rewritten,
    skipped,
)
from support.printed_lines import agrees


def programs(page):
    """Return the commands of a page and the first lines of its other blocks."""
    texts = []
    for block in blocks((ROOT / page).read_text(encoding="utf-8")):
        if block.language == "console":
            texts += [command.words for command in commands(block)]
        elif block.lines:
            texts.append(block.lines[0])
    return texts


def marks(page):
    """Return the marks of a page: most runs and proofs take seconds."""
    is_heavy = any(not skipped(page, text) for text in programs(page))
    return (pytest.mark.heavy,) if is_heavy else ()


@pytest.mark.parametrize("page", [pytest.param(name, marks=marks(name)) for name in pages()])
def test_the_page_shows_what_is_printed(page, tmp_path):
    differences = differences_of(page, tmp_path)
    text = "\n".join(
        "\n".join(
            [
                f"line {difference.start + 1}: shown",
                *difference.shown,
                "printed",
                *difference.printed,
            ]
        )
        for difference in differences
    )
    assert not differences, f"{text}\nif this is meant, run `make docs-outputs`"


@pytest.mark.parametrize("page", NOT_EXECUTED)
def test_what_is_not_executed_is_on_its_page(page):
    where = pages() if page == "*" else [page]
    for beginning, reason in NOT_EXECUTED[page].items():
        texts = [text for name in where for text in programs(name)]
        assert any(text.startswith(beginning) for text in texts), beginning
        assert len(reason) > 10


def test_each_prepared_page_is_there():
    assert set(PREPARED) <= set(pages())


def test_most_of_what_is_shown_runs():
    """The list of exceptions must not grow unseen."""
    texts = [(page, text) for page in pages() for text in programs(page)]
    left_out = [text for page, text in texts if skipped(page, text)]
    assert len(left_out) < 0.15 * len(texts)


@pytest.mark.parametrize(
    ("shown", "printed", "expected"),
    [
        ("v = 1.0000 J", "v = 1.0001 J", True),
        ("v = 1.00 J", "v = 1.02 J", False),
        ("proved", "not decided", False),
        ("a\n...\nb", "a\nx\ny\nb", True),
        ("a\n...\nb", "a\nx\ny\nc", False),
        ("a\n...", "b\na", False),
        ("run completed in 0.08 s -> x", "run completed in 2.5 s -> x", True),
        ("settled at 0.08 s", "settled at 2.5 s", False),
        ("|r| 1.2e-15", "|r| 9.9e-16", True),
        ("a", "a\nb", False),
    ],
)
def test_what_counts_as_the_same(shown, printed, expected):
    assert agrees(shown.splitlines(), printed.splitlines()) is expected


def test_new_outputs_are_written_in_their_place(tmp_path):
    page = "# A page\n\n```pycon\n>>> 1 + 1\n3\n>>> 'a'\n'a'\n```\n\nend\n"
    from support.page_sessions import Session

    session = Session("docs/a_page.md", tmp_path)
    assert "2\n>>> 'a'\n'a'\n" in rewritten(page, session.run(page))
