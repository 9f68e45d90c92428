"""The command `datasets`: the bundled training images and hard data, listed or written out."""

from __future__ import annotations

import click

from ccwsim.cli.options import check_writable
from ccwsim.model.errors import CCWSIMError


@click.command()
@click.argument("name", required=False)
@click.option(
    "-o",
    "--output",
    metavar="FILE",
    help="Write NAME to this file: npy, sgems, gslib, dat or png for a training image; csv, gslib "
    "or dat for hard data.",
)
def command(name: str | None, output: str | None) -> None:
    """List the bundled training images and hard data, or write one of them to a file."""
    from ccwsim import datasets

    if name is None:
        if output is not None:
            raise click.UsageError("--output needs the NAME of what to write")
        click.echo(_listing())
    elif name not in (*datasets.names(), *datasets.hard_data_names()):
        there = ", ".join([*datasets.names(), *datasets.hard_data_names()])
        raise CCWSIMError(f"there is no {name}; there are {there}")
    elif output is None:
        click.echo(_described(name))
    else:
        check_writable(output)
        _write(name, output)
        click.echo(f"Written: {output}", err=True)


def _listing() -> str:
    from ccwsim import datasets

    lines = ["Training images:"]
    lines += [f"  {name:20} {_described(name)}" for name in datasets.names()]
    lines += ["", "Hard data:"]
    lines += [f"  {name:20} {_described(name)}" for name in datasets.hard_data_names()]
    return "\n".join(lines)


def _described(name: str) -> str:
    from ccwsim import datasets

    is_image = name in datasets.names()
    return datasets.describe(name) if is_image else datasets.describe_hard_data(name)


def _write(name: str, output: str) -> None:
    from ccwsim import datasets
    from ccwsim.io import write_hard_data, write_training_image

    if name in datasets.names():
        write_training_image(output, datasets.load(name))
    else:
        write_hard_data(output, datasets.load_hard_data(name))
