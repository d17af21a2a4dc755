"""Every YAML file that is shipped is read as PyYAML composes it, with the place of each value."""

from pathlib import Path
from typing import Any

import pytest
import yaml

from rbstab.config.source import Source, read_source

CONFIGS = Path(__file__).parents[3] / "configs"
FILES = sorted(CONFIGS.rglob("*.yaml"))
WORDS = {"true": True, "false": False, "null": None, "": None}


def check(node: Any, value: Any, path: tuple[Any, ...], source: Source) -> int:
    """Compare a value with its node; return how many values it has."""
    mark = node.start_mark
    where = source.location(path)
    assert path in source.values
    assert (where.line, where.column) == (mark.line + 1, mark.column + 1)
    if isinstance(node, yaml.MappingNode):
        assert list(value) == [key.value for key, _ in node.value]
        for key, _ in node.value:
            of_key = source.location((*path, key.value), of_key=True)
            assert (of_key.line, of_key.column) == (
                key.start_mark.line + 1,
                key.start_mark.column + 1,
            )
        inner = [(entry, value[key.value], (*path, key.value)) for key, entry in node.value]
    elif isinstance(node, yaml.SequenceNode):
        assert type(value) is list
        assert len(value) == len(node.value)
        inner = [(entry, value[i], (*path, i)) for i, entry in enumerate(node.value)]
    else:
        inner = []
        if isinstance(value, str):
            assert value == node.value
            assert node.style or node.value not in WORDS
        elif isinstance(value, int | float) and not isinstance(value, bool):
            assert not node.style
            assert value == float(node.value)
        else:
            assert not node.style
            assert value is WORDS[node.value]
    return 1 + sum(check(*entry, source) for entry in inner)


def test_there_are_files() -> None:
    assert len(FILES) > 50


@pytest.mark.parametrize("file", FILES, ids=lambda file: str(file.relative_to(CONFIGS)))
def test_a_shipped_file(file: Path) -> None:
    source = read_source(file)
    assert source.problems == []
    node = yaml.compose(file.read_text(encoding="utf-8"), Loader=yaml.SafeLoader)
    assert check(node, source.data, (), source) == len(source.values)
