"""Plans as files beside valid bases, and the error messages of invalid plans."""

import pytest
from support.configs import BY_VARIANT, messages_of

from rbstab.sweep.plan.load import load_plan


@pytest.fixture
def write(tmp_path):
    """A function that writes a plan file beside the bases `free.yaml`, `permanent.yaml`, ..."""
    for variant, text in BY_VARIANT.items():
        (tmp_path / f"{variant}.yaml").write_text(text)

    def write(text):
        path = tmp_path / "plan.yaml"
        path.write_text(text)
        return path

    return write


@pytest.fixture
def load(write):
    """A function that loads the plan of a text, with changes as given by `--set`."""

    def load(text, *changes):
        return load_plan(write(text), changes)

    return load


@pytest.fixture
def complaints(write):
    """A function that returns the error messages of a refused plan, without its folder."""

    def complaints(text, *changes):
        path = write(text)
        messages = messages_of(load_plan, path, changes)
        return [
            message.removeprefix(f"{path}:").removeprefix(f"{path.parent}/") for message in messages
        ]

    return complaints
