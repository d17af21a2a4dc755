"""Protects what results show of themselves in the interpreter: one short line, and which array was
meant; and the message about a package that is missing.
"""

import re
import sys
from pathlib import Path

import pytest
from support.results import result

import rbstab
from rbstab.store.variables import optional_module

STORED = Path(__file__).parents[1] / "formats/data/format_1"

EVIL = "\n\x1b[31m" + "y" * 1000


def test_a_run():
    opened = rbstab.open_result(STORED / "runs/embedded.h5")
    shown = repr(opened)
    assert shown.startswith('<rbstab.Result "Stored": outcome ')
    assert re.search(r", \d+ samples, \d+ arrays>$", shown)
    assert ", checks seen, " in shown
    assert len(shown) < 210


def test_a_sweep():
    table = rbstab.open_sweep(STORED / "sweeps/finished_map")
    title = "A map over spin, stored by rbstab 0.1.0"
    assert repr(table) == f'<rbstab.Table "{title}": 30 members, 30 returns, 30 columns>'


def test_traces_and_motions():
    traces = rbstab.open_traces(STORED / "sweeps/finished_variants")
    assert ": 7 members with traces, " in repr(traces)
    assert re.fullmatch(r"<rbstab.Motions: 6 samples, \d+ arrays>", repr(traces.of(0)))
    several = r"<rbstab.Motions: 2 runs, 6 samples, \d+ arrays>"
    assert re.fullmatch(several, repr(next(iter(traces))))


def test_names_of_arrays():
    """A misspelt name is an error that says which one was meant; all names can be listed."""
    run = rbstab.open_result(STORED / "runs/embedded.h5")
    table = rbstab.open_sweep(STORED / "sweeps/finished_map")
    motions = rbstab.open_traces(STORED / "sweeps/finished_variants").of(0)
    for holder, misspelt, meant in (
        (run, "orientatio", "orientation"),
        (table, "settling_tim", "settling_time"),
        (motions, "orientaton", "orientation"),
    ):
        assert list(holder) == holder.keys() == holder._ipython_key_completions_()
        assert meant in holder
        assert all(holder[name].size for name in (meant, holder.keys()[0]))
        with pytest.raises(KeyError, match=rf"no \w+ '{misspelt}'; did you mean {meant}\?"):
            holder[misspelt]
        with pytest.raises(KeyError, match=rf"'xyzzy'; there are: .*{meant}"):
            holder["xyzzy"]
    assert "grid_length" in table.keys()  # noqa: SIM118 (the names, and not the membership)
    with pytest.raises(KeyError, match=r"no column of words 'statu'; did you mean status\?"):
        table.words("statu")
    with pytest.raises(KeyError, match="no column of words 'steps'"):
        table.words("steps")
    with pytest.raises(KeyError, match=r"did you mean settling_time\?"):
        table.shaped("settling_tim")


def test_what_is_not_decided_says_why():
    undecided = result()
    undecided.attributes.update(
        {"convergence": "not decided", "convergence_reason": "no proof is stored; run it again"}
    )
    assert "convergence not decided (no proof is stored)," in repr(undecided)
    proved = result()
    proved.attributes.update({"convergence": "proved", "convergence_reason": "why; it ended"})
    assert "convergence proved," in repr(proved)


def test_names_of_the_package():
    assert set(rbstab.__all__) <= set(dir(rbstab))
    assert not {"Any", "import_module", "_MODULES"} & set(dir(rbstab))
    with pytest.raises(AttributeError) as raised:
        rbstab.simulat  # noqa: B018 (the access is the test)
    # With these the interpreter asks "Did you mean: 'simulate'?".
    assert (raised.value.name, raised.value.obj) == ("simulat", rbstab)


def test_texts_control_no_terminal():
    odd = result()
    odd.attributes.update({"title": EVIL, "verdict": EVIL})
    assert repr(odd).isprintable()
    assert len(repr(odd)) < 1000


def test_a_missing_package_is_named(monkeypatch):
    monkeypatch.setitem(sys.modules, "xarray", None)
    message = r'needs the package xarray. Run: pip install "rbstab\[xarray\]"'
    with pytest.raises(ImportError, match=message):
        result().to_xarray()
    with pytest.raises(ImportError, match=message):
        rbstab.open_sweep(STORED / "sweeps/finished_map").to_xarray()
    with pytest.raises(ImportError, match="needs the package no_such_package"):
        optional_module("no_such_package", "report")
