"""Verbs that explain: words, effects, the form of files."""

from typing import Annotated

import typer


def list_words(
    what: Annotated[str, typer.Argument(metavar="effects|models|roles", help="What to list.")],
) -> None:
    """List the effects, the kinds of models, or the roles of channels, one per line."""
    from discovery.firsthour.explain import list_words as lines_of

    for line in lines_of(what):
        typer.echo(line)


def explain(
    effect: Annotated[str, typer.Argument(metavar="EFFECT", help="A word of `discovery list effects`.")],
) -> None:
    """Explain the physics of EFFECT: formula, size, signature, similar effects."""
    from discovery.firsthour.explain import explain as lines_of

    for line in lines_of(effect):
        typer.echo(line)


def schema(
    file: Annotated[
        str, typer.Argument(metavar="campaign|model|experiment|results|diagnosis", help="Kind of file.")
    ],
) -> None:
    """Print the JSON schema of a file, for editors and for programs that read results."""
    from discovery.firsthour.schemas import schema as schema_of

    typer.echo(schema_of(file))
