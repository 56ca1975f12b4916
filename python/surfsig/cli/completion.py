"""`surfsig completion`: the script that completes commands and options in a shell."""

from __future__ import annotations

import os
from pathlib import Path

import click
from click.shell_completion import get_completion_class

SHELLS = ("bash", "zsh", "fish")


@click.command("completion", epilog='Put  eval "$(surfsig completion bash)"  into ~/.bashrc (zsh alike).')
@click.argument("shell", type=click.Choice(SHELLS), required=False)
@click.pass_context
def completion_command(context: click.Context, shell: str | None) -> None:
    """Print the completion script of a SHELL (by default, the one in use).

    \b
    Examples:
      eval "$(surfsig completion bash)"
      surfsig completion fish > ~/.config/fish/completions/surfsig.fish
    """  # noqa: D301
    name = shell or Path(os.environ.get("SHELL", "")).name
    if name not in SHELLS:
        raise click.UsageError(f"name a shell: {', '.join(SHELLS)}")
    maker = get_completion_class(name)
    assert maker is not None
    click.echo(maker(context.find_root().command, {}, "surfsig", "_SURFSIG_COMPLETE").source())
