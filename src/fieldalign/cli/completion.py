"""fieldalign completion SHELL: the script by which a shell completes verbs, options and files."""

from __future__ import annotations

import click
from click.shell_completion import get_completion_class


@click.command("completion")
@click.argument("shell", type=click.Choice(["bash", "zsh", "fish"]))
def command(shell: str) -> int:
    """Print the script that completes verbs, options and files in SHELL.

    \b
    bash: echo 'eval "$(fieldalign completion bash)"' >> ~/.bashrc
    zsh:  echo 'eval "$(fieldalign completion zsh)"' >> ~/.zshrc
    fish: fieldalign completion fish > ~/.config/fish/completions/fieldalign.fish
    """
    from . import cli

    completion = get_completion_class(shell)
    assert completion is not None
    click.echo(completion(cli, {}, "fieldalign", "_FIELDALIGN_COMPLETE").source())
    return 0
