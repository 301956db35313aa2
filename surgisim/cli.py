"""The command `surgisim`: run the graph on a clip, and say what this machine and this project have."""

import importlib.util
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from surgisim.problem import Problem
from surgisim.stage import Progress, plain_errors

if TYPE_CHECKING:
    from surgisim.viewer.app import Viewer
    from surgisim.viewer.pick import PickPage

app = typer.Typer(
    help="From a monocular surgical video to a simulation with the tissue's own physics.",
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    add_completion=False,
)

Out = Annotated[Path, typer.Option(help="Folder for results/, logs/ and benchmarks/.")]
Operation = Annotated[Path | None, typer.Option(help="A new operation as JSON (docs/operations.md), run as a variant.")]
Variant = Annotated[list[str] | None, typer.Option(help="Variant to run; repeat it, or say 'all'.")]
Variants = Annotated[Path | None, typer.Option(help="A variants.yaml of your own.")]
Config = Annotated[
    list[Path] | None, typer.Option(help="YAML file of the keys of config.yaml that differ; repeatable.")
]
Set = Annotated[list[str] | None, typer.Option("--set", metavar="STAGE.KEY=VALUE", help="One such key; repeatable.")]
Cores = Annotated[str, typer.Option(help="How many cores to use: a number or 'all'.")]
Profile = Annotated[str | None, typer.Option(help="Where to run: gpu, slurm, or a folder with a Snakemake profile.")]
Until = Annotated[str | None, typer.Option(help="Stop after this stage.")]
DryRun = Annotated[bool, typer.Option("--dry-run", "-n", help="Only say what would run.")]
Diagnose = Annotated[bool, typer.Option("--diagnose", help="Also say what physics the simulation lacks.")]
Debug = Annotated[bool, typer.Option(help="Show everything Snakemake says, and tracebacks.")]

GRASP = "What the tool holds: middle and radius in the first frame [px], from when to when [s]; or pick's JSON."
CLICKS = "JSON list of points on tool or tissue: {frame, x, y, label}, in the recording's pixels [px]."


@app.command()
def run(
    clip: Annotated[str, typer.Argument(help="A video, image folder, EndoNeRF folder or zip, or a table clips.tsv.")],
    out: Out = Path(),
    name: Annotated[str | None, typer.Option(help="What to call the clip; its file name unless said.")] = None,
    focal: Annotated[float | None, typer.Option(help="Focal length in the recording's own pixels [px].")] = None,
    grasp: Annotated[str | None, typer.Option(metavar="X,Y,R[,START[,END]]|JSON", help=GRASP)] = None,
    clicks: Annotated[Path | None, typer.Option(help=CLICKS)] = None,
    operation: Operation = None,
    variant: Variant = None,
    variants: Variants = None,
    config: Config = None,
    set_: Set = None,
    cores: Cores = "all",
    profile: Profile = None,
    until: Until = None,
    diagnose: Diagnose = False,
    dry_run: DryRun = False,
    debug: Debug = False,
) -> None:
    """Run the whole graph on a clip; a second run does only what changed."""
    from surgisim.order import Order, called, carry_out

    extra = [f"focal={focal}"] if focal is not None else []
    extra += [f"grasp={'@' if grasp.endswith('.json') else ''}{grasp}"] if grasp else []
    extra += [f"clicks=@{clicks}"] if clicks else []
    with plain_errors(debug):
        order = Order(
            clip=clip,
            name=name or called(Path(clip)),
            out=out,
            variants=tuple(variant or ()),
            book=variants,
            operation=operation,
            configs=tuple(config or ()),
            settings=(*(set_ or ()), *extra),
            cores=cores,
            profile=profile,
            until=until,
            diagnose=diagnose,
            dry=dry_run,
            debug=debug,
        )
        code = carry_out(order)
    raise typer.Exit(code)


@app.command()
def demo(
    out: Out = Path(),
    operation: Operation = None,
    variant: Variant = None,
    variants: Variants = None,
    config: Config = None,
    set_: Set = None,
    cores: Cores = "all",
    profile: Profile = None,
    until: Until = None,
    dry_run: DryRun = False,
    debug: Debug = False,
) -> None:
    """Run the whole graph on the embedded clip, whose truth is known, fitted and at default numbers."""
    from surgisim.config.phantom import Phantom

    camera = Phantom()
    # It knows its camera, as config/clips.tsv says of it; what is set by hand comes after, and counts.
    told = [] if any(s.startswith("phantom.") for s in set_ or ()) else [f"focal={camera.focal * camera.width:g}"]
    run(
        clip="phantom",
        name="demo",
        out=out,
        operation=operation,
        variant=variant or ["main", "elastic_default"],
        variants=variants,
        config=config,
        set_=[*told, *(set_ or [])],
        cores=cores,
        profile=profile,
        until=until,
        dry_run=dry_run,
        debug=debug,
    )


@app.command()
def diagnose(
    recording: Annotated[
        list[Path], typer.Argument(help="A recording folder (docs/diagnosis.md); several of one body that swings.")
    ],
    out: Annotated[
        Path,
        typer.Option(help="Folder for diagnosis.html, diagnosis.json, physics.json, mismatch.npz and mismatch.ply."),
    ],
    config: Config = None,
    set_: Annotated[
        list[str] | None,
        typer.Option("--set", metavar="KEY=VALUE", help="A key of config.yaml's section 'diagnosis'; repeatable."),
    ] = None,
    base: Annotated[
        Path | None, typer.Option(help="The physics.json in which another recording told of this body's base.")
    ] = None,
    hold_out: Annotated[
        Path | None, typer.Option(help="The folder of another recording of this body, foretold and never fitted.")
    ] = None,
    debug: Debug = False,
) -> None:
    """Say what physics a recording's simulation lacks, and how surely; a second start goes on where one stopped."""
    from surgisim.artifacts.base import save_bytes
    from surgisim.diagnosis.files import carry_out
    from surgisim.order import of_diagnosis
    from surgisim.report.diagnosed.case import read
    from surgisim.report.diagnosed.page import page

    with plain_errors(debug):
        settings = of_diagnosis(tuple(config or ()), tuple(set_ or ()))
        typer.echo(carry_out(recording, out, settings, base, hold_out))
        files = (out / name for name in ("diagnosis.json", "mismatch.npz", "physics.json"))
        case = read(recording[0], *files)
        save_bytes({out / "diagnosis.html": page(case, case.made(), progress=Progress("page"))})
        typer.echo(f"{out / 'diagnosis.html'} shows it.")


Host = Annotated[str, typer.Option(help="Where the page is bound; beyond this machine only with a token.")]
Port = Annotated[int, typer.Option(help="Port of the page; 0 takes a free one.")]
Token = Annotated[
    str | None, typer.Option(envvar="SURGISIM_TOKEN", help="What visitors must bring; 16 characters or more.")
]


@app.command()
def view(
    out: Annotated[Path, typer.Argument(help="Folder of a run: what was given to --out.")],
    clip: Annotated[str | None, typer.Option(help="Which clip, where there are several.")] = None,
    variant: Annotated[str | None, typer.Option(help="Which variant; main unless said.")] = None,
    host: Host = "localhost",
    port: Port = 8080,
    token: Token = None,
    device: Annotated[str, typer.Option(help="Where the body by hand is simulated: cpu or cuda.")] = "cpu",
    debug: Debug = False,
) -> None:
    """Look at a run in a browser, and take hold of its tissue: pull, push, cut, let go."""
    with plain_errors(debug):
        from surgisim.viewer.gate import checked_token

        checked_token(host, token)
        if importlib.util.find_spec("viser") is None:
            raise Problem(
                "view: this Python has no viser. Install it with pip install 'surgisim[view]', or run make setup."
            )
        from surgisim.viewer.app import Viewer
        from surgisim.viewer.case import chosen, read
        from surgisim.viewer.manipulation import checked_device

        case = read(out, *chosen(out, clip, variant))
        _serve(Viewer(case, out, host=host, port=port, token=token, device=checked_device(device)))


@app.command()
def pick(
    clip: Annotated[Path, typer.Argument(help="A video, image folder, EndoNeRF folder or zip.")],
    out: Annotated[Path, typer.Option(help="Folder for NAME.clicks.json and NAME.grasp.json.")] = Path(),
    config: Config = None,
    set_: Set = None,
    host: Host = "localhost",
    port: Port = 8080,
    token: Token = None,
    debug: Debug = False,
) -> None:
    """Mark instruments, tissue and what is held in a browser; writes what --clicks and --grasp take."""
    with plain_errors(debug):
        from surgisim.order import of_picking
        from surgisim.viewer.gate import checked_token
        from surgisim.viewer.pick import Picking, PickPage

        checked_token(host, token)
        settings = of_picking(tuple(config or ()), tuple(set_ or ()))
        picking = Picking(clip, out, settings.ingest, settings.masking, progress=Progress("pick"))
        _serve(PickPage(picking, host=host, port=port, token=token))


def _serve(page: "Viewer | PickPage") -> None:
    """Until somebody ends it."""
    typer.echo(f"{page.address} shows it. Ctrl-C ends it.")
    try:
        page.serve()
    except KeyboardInterrupt:
        typer.echo("ended.")
    finally:
        page.close()


@app.command()
def doctor(config: Config = None, debug: Debug = False) -> None:
    """Say what this machine has, and what that means for a run."""
    from surgisim.doctor import examine

    with plain_errors(debug):
        examine(tuple(config or ()))


@app.command()
def terms(debug: Debug = False) -> None:
    """List the laws a body can have: what each is for, its numbers, their ranges."""
    from surgisim.doctor import laws

    with plain_errors(debug):
        laws()


if __name__ == "__main__":
    app()
