"""Protects the comparison with the paper: only runs of its own cases are compared with it."""

from pathlib import Path

import pytest
import yaml
from report.runs.stored import runs_of
from support.made_runs import made_config, made_file

from rbstab.config.load import load_config, resolved_yaml
from rbstab.report.model.document import Table
from rbstab.report.runs.paper_cases import CASES, changed_keys
from rbstab.report.runs.reference_tables import CLAIM, reference_section

PAPER = Path(__file__).parents[3] / "configs" / "paper"


def changes(name, *assignments):
    config = load_config(PAPER / f"{name}.yaml", list(assignments))
    return changed_keys(config, config.model_dump(mode="json", exclude_none=True))


@pytest.mark.parametrize("path", sorted(PAPER.glob("*.yaml")), ids=lambda path: path.stem)
def test_the_configs_of_the_paper_are_its_cases(path):
    assert yaml.safe_load(path.read_text())["reference"]["source"] in CASES
    assert changes(path.stem) == {}


@pytest.mark.parametrize(
    ("assignment", "key"),
    [
        ("body.mass=42", "body.mass"),
        ("controller.K_r[0]=100", "controller.K_r"),
        ("initial.angular_velocity[2]=-15", "initial.angular_velocity"),
        ("initial.position[0]=0.01", "initial.position"),
        ("gravity=[0,0,-9.81]", "gravity"),
        ("integration.duration=1", "integration.duration"),
        ("elements.range={kind: guard, method: barrier, stiffness: 100}", "elements.range.kind"),
    ],
)
def test_a_changed_key_is_found(assignment, key):
    assert key in changes("case2_visco_elastic", "schema_version=2", assignment)


DAMPING = "controller.L_t[1]=7"

SAME = (
    *("title=Mine", "integration.engine=heyoka", "integration.samples=101"),
    # The paper does not print the connector of Case 2.
    "controller.K_c=[1,2,3]",
    "controller.K_r=[[400,0,0],[0,400,0],[0,0,320]]",
)


@pytest.mark.parametrize(
    ("name", "assignments", "expected"),
    [
        *(("case2_visco_elastic", [change], {}) for change in SAME),
        (
            "case1_permanent",
            [DAMPING],
            {"controller.L_t": ([210.0, 7.0, 140.0], [210.0, 210.0, 140.0])},
        ),
        # Another source is not judged.
        ("case1_permanent", [DAMPING, "reference.source=a book"], {}),
    ],
)
def test_what_changes_the_case_is_named_with_both_values(name, assignments, expected):
    assert changes(name, *assignments) == expected


def test_a_changed_run_is_named_and_not_compared(tmp_path):
    """The made config is another experiment than Case 1."""
    reference = {"final": {"orientation": [0.1, 0.2, 0.3]}}
    paths = [
        made_file(tmp_path / f"{name}.h5", made_config(reference=reference | {"source": source}))
        for name, source in (("a", "a book"), ("b", "paper, section 6.1"))
    ]
    section = reference_section(runs_of(*paths))
    assert section is not None
    tables = {block.name: block for block in section.blocks if isinstance(block, Table)}
    assert [row[0].text for row in tables["reference"].rows] == ["a"]
    [row] = tables["reference-changed"].rows
    assert [cell.text for cell in row[:2]] == ["b", "paper, section 6.1"]
    assert "controller.variant = visco-elastic (permanent)" in row[2].text
    assert not any(isinstance(block, str) and "b:" in block for block in section.blocks)


def test_the_claim_of_the_paper_stands_with_its_own_cases_only(tmp_path):
    configs = {path.stem: load_config(path) for path in PAPER.glob("case1_*.yaml")}
    paths = [
        made_file(tmp_path / f"{name}.h5", resolved_yaml(config))
        for name, config in configs.items()
    ]
    section = reference_section(runs_of(*paths, made_file(tmp_path / "other.h5")))
    assert section is not None
    (table,) = [block for block in section.blocks if isinstance(block, Table)]
    claims = [[cell.text for cell in row[:4]] for row in table.rows if row[2].text == CLAIM]
    # The guard of the other config is not of the paper.
    assert claims == [["case1_permanent", "the body is", "globally stable", "not decided"]]
