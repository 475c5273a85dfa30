"""`tmcm34x completion`: commands, options, files and ports by the Tab key."""

from __future__ import annotations

from typing import Final

import click

VARIABLE: Final = "_TMCM34X_COMPLETE"
"""The environment variable by which the script asks this program what a word may become."""
_EXAMPLES: Final = """\b
Put one of these into the file that the shell reads at its start:
  eval "$(tmcm34x completion bash)"         ~/.bashrc
  eval "$(tmcm34x completion zsh)"          ~/.zshrc
  tmcm34x completion fish | source          ~/.config/fish/config.fish
"""


@click.command(epilog=_EXAMPLES)
@click.argument("shell", type=click.Choice(["bash", "zsh", "fish"]))
def command(shell: str) -> int:
    """Print the script with which SHELL completes commands, options, files and ports."""
    from click.shell_completion import get_completion_class

    context = click.get_current_context().find_root()
    script = get_completion_class(shell)
    assert script is not None
    click.echo(script(context.command, {}, "tmcm34x", VARIABLE).source())
    return 0
