"""Verbs from a fitted model to a compensated machine."""

from pathlib import Path
from typing import Annotated

import typer

from discovery.errors import UsageError
from discovery.targets import TARGETS


def export(
    run: Annotated[
        Path, typer.Argument(metavar="RUN", help="Folder of a finished run, or an exported model (.json).")
    ],
    *,
    model: Annotated[str | None, typer.Option(help="Name of one of the models of the run.")] = None,
    to: Annotated[list[str], typer.Option(help=f"{', '.join(TARGETS)}; may be repeated.")],
    out: Annotated[Path | None, typer.Option("--out", help="Folder of the files [RUN/export/MODEL].")] = None,
    campaign: Annotated[Path | None, typer.Option(help="Campaign file [the one of the run].")] = None,
    step: Annotated[float, typer.Option(help="Fixed internal step, s.")] = 10.0,
    states: Annotated[
        int | None, typer.Option(help="First reduce the model to this number of states.")
    ] = None,
    sign: Annotated[
        Path | None, typer.Option(help="Private key (PEM, Ed25519) that signs; created if missing.")
    ] = None,
) -> None:
    """Export a fitted model for the compensation. Each export is first checked against the Python model.

    \b
    discovery export "runs/cutting fluid" --model thermobalance --to c --to fmu
    discovery export "runs/cutting fluid" --model thermobalance --to json --sign machine.pem
    discovery export thermobalance.r2.json --to c --to st
    """
    from discovery.export import export_document, export_run
    from discovery.export.seal import private_key

    key = private_key(sign) if sign else None
    if run.suffix == ".json" and run.is_file():
        if model or campaign or states:
            raise UsageError("an exported model cannot be changed; omit --model, --campaign and --states")
        for line in export_document(run, to, out, key=key).lines():
            typer.echo(line)
        return
    if model is None:
        raise UsageError("--model is missing: name one of the models of the run")
    done = export_run(run, model, to, out, campaign=campaign, step_s=step, states=states, key=key)
    for line in done.lines():
        typer.echo(line)


def compensate(
    model: Annotated[Path, typer.Argument(metavar="MODEL", help="An exported model (.json).")],
    inputs: Annotated[
        str | None, typer.Option(help="CSV file with time and the inputs, or - for stdin.")
    ] = None,
    out: Annotated[Path | None, typer.Option("--out", help="CSV file of the offsets [stdout].")] = None,
    state: Annotated[
        Path | None,
        typer.Option(
            help="Folder that keeps state and models; another MODEL there runs in the shadow first."
        ),
    ] = None,
    trust: Annotated[
        Path | None, typer.Option(help="Public key (.pub) that must have signed the model.")
    ] = None,
    allow_unsigned: Annotated[
        bool, typer.Option("--allow-unsigned", help="Try a model without a key.")
    ] = False,
    shadow_hours: Annotated[float, typer.Option(help="Length of a shadow run.")] = 24.0,
    shadow_um: Annotated[
        float | None,
        typer.Option(help="Difference, um, up to which a new model needs no measured errors."),
    ] = None,
    acknowledge: Annotated[
        bool,
        typer.Option("--acknowledge", help="Operator's acknowledgement: end a FAULT, accept waiting steps."),
    ] = False,
    back: Annotated[bool, typer.Option("--back", help="Go back to the previous model in --state.")] = False,
    opcua: Annotated[Path | None, typer.Option(help="TOML file of an OPC UA connection.")] = None,
    opcua_demo: Annotated[
        bool, typer.Option("--opcua-demo", help="Start a simulated machine server and compensate it.")
    ] = False,
    seconds: Annotated[float | None, typer.Option(help="Stop OPC UA after this time, s.")] = None,
    learn: Annotated[
        Path | None,
        typer.Option(
            metavar="KEY",
            help="Learn from measured errors: follow wear by revisions signed with this private key.",
        ),
    ] = None,
) -> None:
    """Run an exported model: read inputs, write offsets [um, um/m] with status word and heartbeat.

    \b
    discovery compensate model.json --trust machine.pem.pub --inputs in.csv --out offsets.csv --state memory
    discovery compensate model.json --allow-unsigned --opcua-demo --seconds 60
    """
    from discovery.runtime.command import compensate_rows, go_back, one_source, trusted_model
    from discovery.runtime.shadow import Rule

    def say(text: str) -> None:
        typer.echo(text, err=True)

    if back:
        if state is None:
            raise UsageError("--back needs --state, the folder that keeps the models")
        go_back(state, say)
        return
    one_source(
        {"--inputs": inputs, "--opcua": opcua, "--opcua-demo": opcua_demo or None},
        only_opcua={"--seconds": seconds},
        shadow={"--shadow-hours": shadow_hours, "--shadow-um": shadow_um},
    )
    rule = Rule(hours=shadow_hours, most_um=shadow_um)
    if learn is not None and state is None:
        raise UsageError("--learn needs --state, the folder that keeps the models")
    from discovery.runtime.learning import learner

    learns = learner(learn) if learn is not None else None
    exported, key = trusted_model(model, trust, allow_unsigned=allow_unsigned)
    if opcua is not None or opcua_demo:
        from discovery.runtime.opcua import compensate_opcua

        compensate_opcua(
            exported,
            opcua,
            model=model,
            folder=state,
            trusted=key,
            out=out,
            seconds=seconds,
            rule=rule,
            acknowledge=acknowledge,
            learn=learns,
            say=say,
        )
    else:
        assert inputs is not None
        compensate_rows(
            exported,
            inputs,
            out,
            model=model,
            folder=state,
            trusted=key,
            rule=rule,
            acknowledge=acknowledge,
            learn=learns,
            say=say,
        )


def update(
    model: Annotated[Path, typer.Argument(metavar="MODEL", help="The exported model in use (.json).")],
    campaign: Annotated[
        Path,
        typer.Argument(
            metavar="CAMPAIGN", help="A campaign file with the recordings since its last revision."
        ),
    ],
    recordings: Annotated[
        list[str] | None,
        typer.Option(
            "--recording", help="Recording to use; repeatable, in order of time [all of the campaign]."
        ),
    ] = None,
    out: Annotated[
        Path | None, typer.Option("--out", help="File of the next revision [MODEL with .rN].")
    ] = None,
    sign: Annotated[Path | None, typer.Option(help="Private key (PEM, Ed25519) that signs it.")] = None,
) -> None:
    """Adapt an exported model to an ageing machine: was there no change, wear, a faulty input sensor, or
    new physics?

    Wear becomes the next revision, with a changelog entry; `discovery compensate` runs it in the shadow
    first, and `discovery export` writes it to every target.
    """
    from discovery.export.seal import private_key
    from discovery.recordings import load_campaign
    from discovery.runtime.update import next_name, update_file

    loaded = load_campaign(campaign, only=recordings or None)
    names = recordings or list(loaded.recordings)
    key = private_key(sign) if sign else None
    for line in update_file(model, loaded, names, out or next_name(model), key).lines():
        typer.echo(line)


def opcua_certificate(
    connection: Annotated[
        Path, typer.Argument(metavar="FOLDER", help="Folder of the connection file and its certificates.")
    ],
    name: Annotated[str, typer.Option(help="Name of the own files.")] = "compensator",
    uri: Annotated[str | None, typer.Option(help="application_uri of the connection.")] = None,
    fetch: Annotated[
        str | None, typer.Option(metavar="URL", help="Fetch the certificate of the server at URL instead.")
    ] = None,
) -> None:
    """Make a certificate and a key for the compensation, or fetch the certificate of the server.

    \b
    discovery opcua certificate line3
    discovery opcua certificate line3 --fetch opc.tcp://machine:4840
    """
    from discovery.runtime.opcua_form import CLIENT_URI
    from discovery.runtime.opcua_tools import fetch_certificate, make_certificate

    if fetch is None:
        for path in make_certificate(connection, name, uri or CLIENT_URI):
            typer.echo(path)
        typer.echo(f"trust {name}.der at the server; application_uri is {uri or CLIENT_URI}")
    else:
        import asyncio

        print_of_it = asyncio.run(fetch_certificate(fetch, connection / "server.der"))
        typer.echo(
            f"{connection / 'server.der'}: SHA-1 {print_of_it}; compare it with what the machine shows"
        )


def opcua_browse(
    connection: Annotated[Path, typer.Argument(metavar="CONNECTION", help="TOML file of the connection.")],
    node: Annotated[str, typer.Option(help="Node id to begin with.")] = "i=85",
    depth: Annotated[int, typer.Option(help="How many levels down.")] = 6,
) -> None:
    """List the variables of a server: node id, type, rights, value, path."""
    import asyncio

    from discovery.files import read_toml
    from discovery.runtime.opcua_form import ConnectionForm
    from discovery.runtime.opcua_tools import browse

    form = read_toml(connection, ConnectionForm)

    async def work() -> None:
        async for line in browse(form, connection.parent, node, depth):
            typer.echo(line)

    asyncio.run(work())


def watch(
    state: Annotated[
        Path, typer.Argument(metavar="STATE", help="Folder that you gave to `discovery compensate --state`.")
    ],
    port: Annotated[int, typer.Option(help="Port of the page. Only this computer can open it.")] = 8467,
    hours: Annotated[float, typer.Option(help="Hours of the past that the page shows.")] = 24.0,
) -> None:
    """Show a running compensation in a browser: offsets, inputs, state, events; and /metrics for
    Prometheus.
    """
    from discovery.runtime.watch import serve

    serve(state, port, hours, say=typer.echo)
