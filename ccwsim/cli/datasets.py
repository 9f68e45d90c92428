"""The command `datasets`, which lists or writes the bundled training images and hard data."""

import click

from ccwsim import CCWSIMError
from ccwsim.cli.options import suggestion


@click.command()
@click.argument("name", required=False)
@click.option(
    "-o",
    "--output",
    metavar="FILE",
    type=click.Path(),
    help="Write NAME to this file. The ending gives the format: npy, sgems, gslib, dat or png for "
    "a training image; csv, gslib or dat for hard data.",
)
def command(name: str | None, output: str | None) -> None:
    """List the bundled training images, volumes and hard data, or write one of them to a file."""
    from ccwsim import datasets

    images = {name: datasets.describe(name) for name in datasets.BUNDLED_IMAGES}
    volumes = {name: images.pop(name) for name in datasets.volume_names()}
    hard_data = {name: datasets.describe_hard_data(name) for name in datasets.BUNDLED_DATA}
    described = images | volumes | hard_data
    if name is None:
        if output is not None:
            raise click.UsageError("--output needs the NAME of a training image or of hard data")
        titles = {"Training images:": images, "\nVolumes:": volumes, "\nHard data:": hard_data}
        for title, texts in titles.items():
            click.echo("\n".join([title, *(f"  {key:26} {text}" for key, text in texts.items())]))
    elif name not in described:
        choices = ", ".join(described)
        raise CCWSIMError(f"there is no {name}; there are {choices}.{suggestion(name, described)}")
    elif output is None:
        click.echo(described[name])
    else:
        from ccwsim.io import write_hard_data, write_training_image

        if name in hard_data:
            write_hard_data(output, datasets.load_hard_data(name))
        else:
            write_training_image(output, datasets.load(name))
        click.echo(f"Written: {output}", err=True)
