"""Fixtures that write a config, load it, or collect the messages of its errors."""

import pytest
from support.configs import messages_of

from rbstab.config.load import load_config


@pytest.fixture
def write(tmp_path):
    """Write a config file; line ends are kept as they are."""

    def write(text):
        path = tmp_path / "config.yaml"
        path.write_bytes(text if isinstance(text, bytes) else text.encode())
        return path

    return write


@pytest.fixture
def load(write):
    """Load the config of a text, with changes as `--set` takes them."""

    def load(text, *changes):
        return load_config(write(text), changes)

    return load


@pytest.fixture
def complaints(write):
    """Return the error messages of a config that must be refused.

    The path of the file is left out: a message begins with its line, or with `--set` for a change.
    """

    def complaints(text, *changes):
        path = write(text)
        messages = messages_of(load_config, path, changes)
        return [message.removeprefix(f"{path}:") for message in messages]

    return complaints
