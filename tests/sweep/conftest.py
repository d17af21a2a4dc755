import pytest
from support.configs import BY_VARIANT

from rbstab.config.errors import ConfigError
from rbstab.sweep.plan.load import load_plan


@pytest.fixture
def write(tmp_path):
    """Writes a plan file beside the bases `free.yaml`, `permanent.yaml`, and so on."""
    for variant, text in BY_VARIANT.items():
        (tmp_path / f"{variant}.yaml").write_text(text)

    def write(text):
        path = tmp_path / "plan.yaml"
        path.write_text(text)
        return path

    return write


@pytest.fixture
def load(write):
    """The plan of a text and of changes as `--set` takes them."""

    def load(text, *changes):
        return load_plan(write(text), changes)

    return load


@pytest.fixture
def complaints(write):
    """What is said about a plan that must be refused, one message each, without its folder."""

    def complaints(text, *changes):
        path = write(text)
        with pytest.raises(ConfigError) as caught:
            load_plan(path, changes)
        messages = str(caught.value).splitlines()
        assert messages == [str(problem) for problem in caught.value.problems]
        return [
            message.removeprefix(f"{path}:").removeprefix(f"{path.parent}/") for message in messages
        ]

    return complaints
