"""Small reports for tests of PDFs, and readers of their pages."""

from io import BytesIO

import numpy as np
from pypdf import PdfReader

from rbstab.report.model.document import Animation, Cell, Head, Report, Section, Solid, Table
from rbstab.report.model.figure import Axis, Figure, Line, Panel
from rbstab.report.writers.pdf import pdf_of

X = np.linspace(0, 1, 5)


def figure_of(power):
    panel = Panel(Axis("x"), Axis("y"), (Line(X, X**power),))
    return Figure("f", "A curve", (panel,), source="as Fig. 3", caption="It rises.")


FIGURE = figure_of(2)


def report(*blocks, title="A report", **options):
    sections = (Section("first", "The first section", blocks), Section("second", "The second", ()))
    return Report(title, "2026-01-02T03:04:05", "rbstab report a.h5 --pdf", sections, **options)


def read(made):
    return PdfReader(BytesIO(pdf_of(made)))


def text_of(reader):
    return " ".join(" ".join(page.extract_text() for page in reader.pages).split())


def table_of(columns, rows, width=8, **options):
    heads = [Head("name"), *(Head(f"h{c}", "m", numbers=True) for c in range(1, columns))]
    cells = [
        tuple(Cell(f"{'r' if c == 0 else 'c'}{r}-{c}".ljust(width, ".")) for c in range(columns))
        for r in range(rows)
    ]
    return Table("t", "A table", tuple(heads), tuple(cells), **options)


SOLID = Solid(np.array([[0.0, 0, 0], [0, 1, 0], [0, 0, 1]]), np.array([[0, 1, 2]]))


MOTION = Animation(
    "m",
    "case 1",
    X[:2],
    np.zeros((2, 3)),
    np.array([[1.0, 0, 0, 0], [0.8, 0.6, 0, 0]]),
    SOLID,
    np.array([0.0, 0, 0.4]),
    np.zeros(3),
    stills=(0, 1),
)
