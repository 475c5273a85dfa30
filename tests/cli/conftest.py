"""The command line in this process."""

import pytest
from click.testing import CliRunner

from tmcm34x.cli import group


@pytest.fixture
def invoke(tmp_path, monkeypatch):
    """Call it in a folder of its own with the words of a command line: exit status, standard output and error."""
    monkeypatch.chdir(tmp_path)

    def call(*words):
        result = CliRunner().invoke(group, [str(word) for word in words], standalone_mode=False)
        if result.exception is not None and not hasattr(result.exception, "exit_code"):
            raise result.exception
        status = getattr(result.exception, "exit_code", result.return_value or 0)
        message = result.exception.format_message() if result.exception is not None else ""
        return status, result.stdout, result.stderr + message

    return call
