"""Protects the HTML page of a report: one file, no outside links, no foreign scripts or markup."""

import base64
import gzip
import hashlib
import json
import re
from html.parser import HTMLParser

import pytest
from support.pages import HOSTILE, hostile_report, report

from rbstab.report.model.document import (
    Card,
    Cards,
    Cell,
    Head,
    Report,
    Section,
    Sketch,
    Statement,
    Table,
)
from rbstab.report.writers.html import page


class Reader(HTMLParser):
    """The elements of a page: their names, attributes, and texts."""

    def __init__(self, text):
        super().__init__(convert_charrefs=True)
        self.elements: list[tuple[str, dict[str, str | None]]] = []
        self.texts: list[str] = []
        self.scripts: list[tuple[str | None, str]] = []
        self.inside_script = False
        self.feed(text)

    def handle_starttag(self, tag, attrs):
        self.elements.append((tag, dict(attrs)))
        self.inside_script = tag == "script"
        if tag == "script":
            self.scripts.append((dict(attrs)["type"], ""))

    def handle_endtag(self, tag):
        self.inside_script = False

    def handle_data(self, data):
        self.texts.append(data)
        if self.inside_script:
            kind, before = self.scripts[-1]
            self.scripts[-1] = (kind, before + data)


@pytest.fixture(scope="module")
def whole():
    """The page of a report with every kind of block."""
    return page(report())


def test_the_page_points_nowhere_but_into_itself(whole):
    reader = Reader(whole)
    names = {name for _, attributes in reader.elements for name in attributes}
    assert not names & {"src", "srcset", "action", "background", "poster"}
    targets = [attributes["href"] for _, attributes in reader.elements if "href" in attributes]
    ids = {attributes["id"] for _, attributes in reader.elements if "id" in attributes}
    assert targets
    assert all(str(target)[0] == "#" and str(target)[1:] in ids for target in targets)
    style = re.search(r"<style>(.*?)</style>", whole, re.DOTALL)
    assert style is not None
    assert "url(" not in style[1]
    assert "@import" not in style[1]


def test_only_the_scripts_of_the_page_may_run(whole):
    reader = Reader(whole)
    policy = next(a["content"] for tag, a in reader.elements if a.get("http-equiv"))
    assert policy is not None
    assert policy.startswith("default-src 'none';")
    (script,) = [text for kind, text in reader.scripts if kind == "module"]
    digest = base64.b64encode(hashlib.sha256(script.encode()).digest()).decode()
    allowed = re.search(r"script-src ([^;]*);", policy)
    assert allowed is not None
    assert f"'sha256-{digest}'" in allowed[1]
    assert "unsafe" not in allowed[1]


def test_ids_are_unique(whole):
    ids = [attributes["id"] for _, attributes in Reader(whole).elements if "id" in attributes]
    assert len(ids) == len(set(ids))


def unpacked(packed):
    return gzip.decompress(base64.b64decode(packed)).decode()


def test_the_library_is_there_once_and_only_for_figures(whole):
    packed = [text for kind, text in Reader(whole).scripts if kind == "text/plain"]
    drawings, library = map(unpacked, packed)
    assert "vegaEmbed=" in library
    assert set(json.loads(drawings)) == {"over-time", "maps", "counts"}
    words = Report("t", "c", "c", (Section("s", "S", ("words",)),))
    assert len(page(words)) < 100_000


def test_texts_are_texts_whatever_they_look_like():
    reader = Reader(page(hostile_report()))
    assert not {"img", "b"} & {tag for tag, _ in reader.elements}
    assert len(reader.scripts) == 4
    shown = "".join(reader.texts)
    assert shown.count(HOSTILE) >= 10
    (motions,) = [text for kind, text in reader.scripts if kind == "application/json"]
    drawings = next(text for kind, text in reader.scripts if kind == "text/plain")
    assert json.loads(unpacked(drawings))["figure"]["legend"][0]["label"] == HOSTILE
    assert set(json.loads(motions)) == {"run-1"}


def test_what_could_not_be_read_is_named(whole):
    texts = Reader(whole).texts
    assert "results/broken.h5" in texts
    assert any("it is damaged" in text for text in texts)


def test_the_same_report_makes_the_same_page(whole):
    assert page(report()) == whole


def test_a_name_that_is_no_text_can_be_written():
    odd = Report("\udcff", "c", "c", ())
    assert page(odd).encode()


def test_names_break_only_at_their_joints():
    name = "initial.angular_velocity[0] over 0.5 <b>"
    table = Table("t", name, (Head(name),), ((Cell(name),),))
    text = page(Report(name, "c", "c", (Section("s", name, (table,)),)))
    whole = "initial.<wbr>angular_<wbr>velocity[0] over 0.5 &lt;b&gt;"
    # The title of the report, the link to the section, its heading, and three in the table.
    assert text.count(whole) == 6


def test_a_sketch_has_words_at_the_ends_of_its_axes():
    sketch = Sketch("v", (), x_ends=("0 s", "2 s"), y_ends=("<low", "high"))
    cards = Cards("c", (Card("1", (), sketch=sketch),))
    text = page(Report("t", "c", "c", (Section("s", "S", (cards,)),)))
    for place, word in (("up", "high"), ("low", "&lt;low"), ("left", "0 s"), ("right", "2 s")):
        assert f'<span class="{place}" aria-hidden="true">{word}</span>' in text


def test_numbers_keep_their_units_and_commands_their_options():
    """Spaces that do not break, and options as one word; a command to copy stays as it is."""
    text = "At 20 N m, see rbstab run plan.yaml --allow-python"
    cells = (Cell("gust 20 N m"), Cell("7", 7.0, command="rbstab run 'a 5 s' --member 7"))
    blocks = (
        text,
        Table("t", "Title: 20 N m", (Head("a"), Head("b")), (cells,), f"Note: {text}"),
        Cards("c", (Card("a", (Statement("q", "seen", text),), (("peak", "20 N m"),)),)),
    )
    html = page(Report("R", "2026-01-02", "rbstab --x 5 s", (Section("s", "S", blocks),)))
    assert html.count("20\u00a0N\u00a0m") == 6
    assert "20 N m" not in html
    assert html.count('<span class="whole">--allow-python</span>') == 3
    assert 'data-command="rbstab run &#39;a 5 s&#39; --member 7"' in html
    assert "<code>rbstab --x 5 s</code>" in html
