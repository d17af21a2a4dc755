import pytest

from rbstab.config.errors import ConfigError
from rbstab.config.load import load_config


@pytest.fixture
def write(tmp_path):
    """Writes a config file; line ends are kept as they are."""

    def write(text):
        path = tmp_path / "config.yaml"
        path.write_bytes(text if isinstance(text, bytes) else text.encode())
        return path

    return write


@pytest.fixture
def load(write):
    """The config of a text and of changes as `--set` takes them."""

    def load(text, *changes):
        return load_config(write(text), changes)

    return load


@pytest.fixture
def complaints(write):
    """What is said about a config that must be refused, one message each.

    The path of the file is left out, so that a message begins with its line; what stands in a
    change begins with `--set`.
    """

    def complaints(text, *changes):
        path = write(text)
        with pytest.raises(ConfigError) as caught:
            load_config(path, changes)
        messages = str(caught.value).splitlines()
        assert messages == [str(problem) for problem in caught.value.problems]
        return [message.removeprefix(f"{path}:") for message in messages]

    return complaints
