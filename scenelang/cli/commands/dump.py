"""``scenelang dump``: stages of the compiler as text, data or a drawing, and what drawing a scene takes."""

from __future__ import annotations

import json
import shutil
import subprocess
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, Literal

import click

from scenelang.cli import options
from scenelang.cli.main import Trouble
from scenelang.cli.say import put_out
from scenelang.compiler.passes import PASSES
from scenelang.drawing.how import How, threads_for
from scenelang.language.diagnostics import plural
from scenelang.language.words import COMBINE

if TYPE_CHECKING:
    from scenelang.cli.inputs import Input

Kind = Literal["text", "json", "mmd", "dot", "svg", "png"]
_DRAWN: Final = ("mmd", "dot", "svg", "png")
STAGES: Final = ("syntax", "scene", "lower", *(step.name for step in PASSES), "program")
_PATIENCE_S: Final = 60


@click.command("dump")
@click.argument("file", metavar="FILE")
@click.option(
    "--after", "stages", multiple=True, type=click.Choice(STAGES), help="Stage or pass to show; may be given "
    "several times. By default program, with --diff all, and of drawings scene.",
)  # fmt: skip
@click.option("--diff", is_flag=True, help="Show only what each pass changed.")
@click.option("--costs", is_flag=True, help="Show what drawing the scene takes and what is left out of it.")
@click.option(
    "--format", "kind", type=click.Choice(("text", "json", *_DRAWN)), help="Format of what is printed, or of "
    "a drawing of the graph: mmd (Mermaid), dot, or svg and png, which need Graphviz; by default the one of "
    "OUT's suffix, else text.",
)  # fmt: skip
@options.count("--most", high=10_000, default=200, help="Largest number of boxes to draw.")
@options.out
@options.request()
@options.drawing("device", "threads")
@click.pass_context
def command(
    ctx: click.Context,
    file: str,
    stages: tuple[str, ...],
    diff: bool,
    costs: bool,
    kind: Kind | None,
    most: int,
    out: str | None,
    request: options.Request,
    how: How,
) -> None:
    """Show what a scene is after stages of the compiler, or draw its graph.

    FILE is a scene, or - for standard input. The stages are in order syntax (the tree), scene, lower (the
    graph as written), the passes and program. A scene with mistakes is shown as far as it goes; then the exit
    code is 1.

    Drawings show transforms, materials and booleans; large scenes are cut, and a box says how many nodes are
    left out.

    --costs shows objects, matrices and tokens after each pass, the model and the next best, how many pixels
    an object reached and how many samples met how many objects (in space how many rays were followed, their
    steps and evaluations of the network), the parameters, the time of a frame, and the error against the
    exact picture.
    """
    from scenelang.cli.inputs import prepare_scene

    suffix = Path(out or "").suffix[1:].lower()
    form = kind or (suffix if suffix in _DRAWN else "text")
    drawn = form in _DRAWN
    if costs and (stages or diff or drawn):
        raise click.UsageError("--costs is of the whole scene; leave out --after, --diff and drawings.")
    if drawn and (diff or len(stages) > 1):
        raise click.UsageError("A drawing is of one stage, with --after.")
    if drawn and "syntax" in stages:
        raise click.UsageError("The syntax tree has no drawing.")
    job = prepare_scene(file, request)
    if (costs or drawn) and (job.scene is None or job.program is None or job.failed()):
        ctx.exit(1)
    if costs:
        plan = _plan(job, request, how)
        put_out((json.dumps(plan, indent=2) if form == "json" else _costs_text(plan)) + "\n", out)
    elif drawn:
        text = _drawing(job, stages[0] if stages else "scene", form, most)
        put_out(_picture(form, text) if form in ("svg", "png") else text, out)
    else:
        shown = list(_changes(job, stages) if diff else _whole(job, stages or ("program",), form))
        if form == "json":
            text = json.dumps({"version": 1, "stages": shown}, indent=2, ensure_ascii=False) + "\n"
        else:
            titled = len(shown) > 1 or diff
            text = "\n".join((f"after {one['stage']}:\n" if titled else "") + one["text"] for one in shown)
        put_out(text, out)
    ctx.exit(int(job.failed()))


def _changes(job: Input, wanted: tuple[str, ...]) -> Iterator[dict[str, Any]]:
    """The differences that the passes made, of those that made any; all passes, or the wanted."""
    from scenelang.editors.dumps import changes, dump

    before, old = "", "nothing"
    for name, graph in job.graphs.items():
        text = before if before and job.graphs[old] is graph else dump(graph)
        if not wanted or name in wanted:
            said = changes(before, text, old, name) if before else text
            if said or wanted:
                yield {"stage": name, "text": said}
        before, old = text, name


def _whole(job: Input, wanted: tuple[str, ...], kind: str) -> Iterator[dict[str, Any]]:
    """The stages that were reached, as text or as data."""
    from scenelang.editors.dumps import dump, graph_data, program_data, program_table, tree_data, tree_text

    known: dict[str, tuple[str, Any, Callable[[Any], Any], Callable[[Any], str]]] = {
        name: ("graph", graph, graph_data, dump) for name, graph in job.graphs.items()
    }
    known["syntax"] = ("tree", job.tree, tree_data, tree_text)
    known["scene"] = ("scene", job.scene, lambda s: json.loads(s.to_json()), lambda s: str(s.to_nsg()))
    known["program"] = ("program", job.program, program_data, program_table)
    for name in wanted:
        key, value, data, text = known.get(name, ("", None, str, str))
        if value is not None:
            yield {"stage": name, **({key: data(value)} if kind == "json" else {"text": text(value)})}


def _drawing(job: Input, stage: str, kind: str, most: int) -> str:
    """The graph of a stage as Mermaid or DOT, of so many boxes at most."""
    from scenelang.editors import dumps

    if stage in job.graphs:
        drawing = dumps.draw_graph(job.graphs[stage], most)
    elif stage == "program" and job.program is not None:
        drawing = dumps.draw_program(job.program, most)
    else:
        assert job.scene is not None
        drawing = dumps.draw_scene(job.scene, most)
    return (dumps.to_mermaid if kind == "mmd" else dumps.to_dot)(drawing, stage == "program")


def _picture(kind: str, text: str) -> bytes:
    """A picture of DOT text by Graphviz."""
    if (dot := shutil.which("dot")) is None:
        raise click.UsageError(
            f".{kind} needs Graphviz, whose program `dot` is not here: install the package `graphviz`, "
            "or write .dot or .mmd, which need nothing."
        )
    try:
        done = subprocess.run(
            [dot, f"-T{kind}"], input=text.encode(), capture_output=True, timeout=_PATIENCE_S, check=False
        )
    except subprocess.TimeoutExpired:
        raise Trouble(f"dot took more than {_PATIENCE_S} seconds; draw fewer boxes with --most") from None
    if done.returncode != 0 or not done.stdout:
        said = done.stderr.decode(errors="replace").strip().splitlines()
        raise Trouble(f"dot failed{f': {said[0]}' if said else ''}")
    return done.stdout


def _plan(job: Input, request: options.Request, how: How) -> dict[str, Any]:
    """Draw the scene and say what that took."""
    from scenelang.drawing.torch_backend import choose_device, open_model
    from scenelang.output.frontier import plan_of

    assert job.scene is not None
    assert job.program is not None
    opened = open_model(job.program.model, choose_device(how.device))
    asked, cores = request.source.model is not None, how.threads or threads_for(job.program.canvas)
    result = plan_of(job.scene, job.program, job.graphs, opened, asked=asked, spans=job.spans, threads=cores)
    return {"version": 1, "file": job.name, **result}


def _costs_text(plan: dict[str, Any]) -> str:
    cost = plan["drawing"]
    if plan["runner_up"]:
        others = f"next best {plan['runner_up']}"
    else:
        others = "no other has all the scene uses" if plan["lacking"] else "there is no other"
    tokens = ", ".join(f"{number:,} {word}" for word, number in plan["tokens"].items())
    error = f"not known: {cost['unknown']}"
    if cost["unknown"] is None:
        flip = "" if cost["flip"] is None else f", FLIP {cost['flip']:.4f},"
        error = f"{cost['psnr']:.2f} dB PSNR (50 at most){flip} against the exact picture"
    lines = [f"stream     {plural(plan['rows'], 'row')} of 64 numbers ({tokens or 'empty'})"]
    lines += _rays(cost, plan["rows"]) if "rays" in cost else _meetings(cost)
    lines += [f"frame      {cost['ms']:.1f} ms", f"error      {error}", ""]
    lines += [f"model {plan['model']} ({plan['why']}), {cost['parameters']:,} parameters; {others}"]
    lines += [f"  {name} lacks {', '.join(names)}" for name, names in plan["lacking"].items()]
    return "\n".join([*lines, "", *_table(plan["stages"])])


def _meetings(cost: dict[str, Any]) -> list[str]:
    return [
        f"pixels     {cost['evaluated']:,} of {cost['pixels']:,} evaluated "
        f"({_share(cost['evaluated'], cost['pixels'])}), {cost['refined']:,} of them sampled four times "
        f"({_share(cost['refined'], cost['pixels'])})",
        f"meetings   {cost['meetings']:,} of a sample and an object, "
        f"{_share(cost['meetings'], cost['meetings_unskipped'])} of {cost['meetings_unskipped']:,}",
    ]


def _rays(cost: dict[str, Any], objects: int) -> list[str]:
    rays, steps = cost["rays"] + cost["light_rays"], cost["steps"]
    return [
        f"pixels     {cost['refined']:,} of {cost['pixels']:,} sampled four times "
        f"({_share(cost['refined'], cost['pixels'])})",
        f"rays       {cost['rays']:,} from the eye and {cost['light_rays']:,} to the light, "
        f"{_share(cost['near'], rays)} near an object",
        f"steps      {steps:,}, {steps / max(1, cost['near']):.1f} on a ray near an object",
        f"network    {cost['evaluations']:,} evaluations of an object, "
        f"{cost['evaluations'] / max(1, steps):.2f} of {objects} a step",
    ]


def _table(stages: list[dict[str, Any]]) -> list[str]:
    """A line for each stage; a column for each word that joins something in one of them."""
    words = [w for w in COMBINE if any(w in s["tokens"] for s in stages)]
    heads = ["objects", "matrices", "affine", "deform", "folds", *words]
    lines = [f"{'after':16}" + "".join(f"{head:>10}" for head in heads) + "  (= as before)"]
    for row in stages:
        values = [row[key] for key in ("objects", "matrices", "affines", "deformations", "folds")]
        values += [row["tokens"].get(word, 0) for word in words]
        mark = "" if row["changed"] or row["stage"] == "lower" else "  ="
        lines.append(f"{row['stage']:16}" + "".join(f"{value:10,}" for value in values) + mark)
    return lines


def _share(part: int, whole: int) -> str:
    return f"{100 * part / whole if whole else 0.0:.1f} %"
