"""The numbers of boxes that docs/proofs.md gives are those of the proofs of the same configs."""

import re
from pathlib import Path

import pytest

import rbstab

ROOT = Path(__file__).resolve().parents[2]
PAGE = (ROOT / "docs" / "proofs.md").read_text(encoding="utf-8")

SLACK = 0.02
"""Other versions of numpy round in other places: a box more or less is halved near a bound."""


def rows(header: str) -> list[list[str]]:
    """Return the cells of the tables with a header that ends so."""
    found = re.findall(rf"^\|[^\n]*{re.escape(header)}\n\|[-|]+\n((?:\|.*\n)+)", PAGE, re.MULTILINE)
    lines = [line for table in found for line in table.splitlines()]
    return [[cell.strip() for cell in line.strip("|").split("|")] for line in lines]


def config_named(cell: str) -> Path:
    """Return the config that a cell names, with or without a link."""
    (name,) = re.findall(r"\w+", cell.split("](", maxsplit=1)[0].removesuffix(".yaml").strip("["))
    (path,) = (ROOT / "configs").rglob(f"{name}.yaml")
    return path


def number(text: str) -> int:
    return int(text.replace(",", ""))


IN_TABLES = [
    (config_named(cells[0]), number(cells[-2]), number(cells[-1]))
    for cells in rows("| boxes, range of eq. 5 | boxes, all real θ1 and θ3 |")
]


def test_the_tables_were_found():
    assert [path.stem for path, *_ in IN_TABLES] == [
        "case1_guarded",
        "case2_guarded",
        "case3_guarded",
        "ligament_proved",
    ]


@pytest.mark.parametrize(("path", "inner", "wide"), IN_TABLES)
def test_tables_of_boxes(path, inner, wide):
    proof = rbstab.prove(path)
    assert proof.unwrapped is not None
    assert proof.examined == pytest.approx(inner, rel=SLACK)
    assert proof.unwrapped.examined == pytest.approx(wide, rel=SLACK)


@pytest.mark.parametrize(
    ("name", "sentence"),
    [
        ("stop", "proves five rest states in ([0-9,]+) boxes"),
        ("strut_proved", "takes ([0-9,]+) boxes, and ([0-9,]+) for all real θ1 and θ3"),
        ("cubic_spring", "takes ([0-9,]+) boxes, and [0-9,]+ for its"),
        ("rubber_cord", "its only rest state is proved in ([0-9,]+) boxes"),
    ],
)
def test_sentences_about_boxes(name, sentence):
    path = ROOT / "configs" / "examples" / f"{name}.yaml"
    proof = rbstab.prove(rbstab.load_config(path, allow_python=True))
    (found,) = re.findall(rf"{name}\.yaml[^\n]*?{sentence}", PAGE)
    counts = [number(one) for one in ([found] if isinstance(found, str) else found)]
    made = [proof.examined, *([proof.unwrapped.examined] if proof.unwrapped else [])]
    assert made[: len(counts)] == pytest.approx(counts, rel=SLACK)
