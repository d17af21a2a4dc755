"""Protects `docs/inputs.md`: its example is the file, its keys and units are those of the program,
and its commands run.
"""

import re

from support.documents import ROOT, blocks_of, page, section, tables

import rbstab
from rbstab.config.sections.signals import SIGNAL_UNITS, SIGNALS
from rbstab.elements.registry import KINDS

PAGE = page("inputs")
EXAMPLE = ROOT / "configs/examples/driven.yaml"


def rows(heading):
    """Return the rows of the tables below a heading, by the name in their first column."""
    table_rows = [row for table in tables(section(PAGE, heading)) for row in table[1:]]
    return {row[0].strip("`"): " | ".join(row[1:]) for row in table_rows}


def test_the_example_is_in_the_file():
    (block,) = blocks_of(PAGE, "yaml")
    assert block in EXAMPLE.read_text(encoding="utf-8")
    inputs = [e for e in rbstab.load_config(EXAMPLE).elements.values() if e.kind == "input"]
    assert block.count("kind: input") == len(inputs) == 3


def test_each_quantity_has_its_row_with_its_unit_and_keys():
    table = rows("The load")
    for quantity, element in KINDS["input"].items():
        units = {gain.name: gain.unit for gain in element.gains}
        row = table.pop(str(quantity))
        assert f"{units['amplitude']} | " in row
        assert row.endswith("body" if "body" in str(quantity) else "inertial")
        assert ("point" in units) == ("at `point`" in row)
    assert set(table) == {"point", "direction", "amplitude", "signal"}


def test_each_signal_has_its_row_with_its_keys():
    table = rows("The signal")
    assert set(table) == set(SIGNALS)
    for kind, model in SIGNALS.items():
        for key in model.model_fields.keys() - {"kind", "source"}:
            assert f"`{key}`" in table[kind]
            unit = SIGNAL_UNITS.get(key)
            assert unit in {None, "1"} or str(unit) in table[kind]


def test_the_table_of_the_page_can_be_read(tmp_path):
    (text,) = re.findall(r"\n((?:    [-\d.a-z]+, [-\d.a-z]+\n)+)", PAGE)
    text = text.replace("    ", "")
    (tmp_path / "t.csv").write_text(text, encoding="utf-8")
    data = EXAMPLE.read_text(encoding="utf-8")
    signal = "{kind: sine, frequency: 2.5}"
    assert signal in data
    config = tmp_path / "x.yaml"
    config.write_text(data.replace(signal, "{kind: table, file: t.csv}"), encoding="utf-8")
    signal = rbstab.load_config(config).elements["shake"].signal
    assert signal.times == (0.0, 0.5, 2.0)
