"""``scenelang fit``: the params of a scene from a picture."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import click

from scenelang.cli import options
from scenelang.cli.files import targets
from scenelang.cli.main import Trouble
from scenelang.cli.say import Bar, put_out

NOT_CONVERGED = 1
MOST_FRAMES = 10_000  # whose pictures are looked for


def _crop(ctx: click.Context, param: click.Parameter, value: str | None) -> tuple[int, int, int, int] | None:
    result = re.fullmatch(r"(\d{1,5})[x×](\d{1,5})\+(\d{1,5})\+(\d{1,5})", value or "")
    if value is not None and (result is None or not int(result[1]) or not int(result[2])):
        raise click.BadParameter(f"`{value}` is not a part such as 320x192+10+20", ctx, param)
    return (int(result[3]), int(result[4]), int(result[1]), int(result[2])) if result else None


def _colour(ctx: click.Context, param: click.Parameter, value: str) -> tuple[float, float, float]:
    result = re.fullmatch(r"#?([0-9a-fA-F]{2})([0-9a-fA-F]{2})([0-9a-fA-F]{2})", value)
    if result is None:
        raise click.BadParameter(f"`{value}` is not a colour such as #fff4e0", ctx, param)
    return int(result[1], 16) / 255, int(result[2], 16) / 255, int(result[3], 16) / 255


def _to(ctx: click.Context, param: click.Parameter, values: tuple[str, ...]) -> Path | dict[int, Path]:
    """One picture, or several by frames."""
    from scenelang.output.frames import Target, is_pattern

    result: dict[int, Path] = {}
    for value in values:
        number, _, name = value.partition("=")
        if number.isdecimal():
            result[int(number)] = Path(name)
        elif is_pattern(value):
            numbered = Target("sequence", Path(value).parent, Path(value).name)
            files = ((frame, numbered.file(frame)) for frame in range(MOST_FRAMES))
            result |= {frame: file for frame, file in files if file.exists()}
        elif len(values) == 1:
            return Path(value)
        else:
            raise click.BadParameter(f"`{value}` is one of several; say its frame, 12={value}", ctx, param)
    if not result:
        raise click.BadParameter(f"there is no picture `{values[0]}`", ctx, param)
    return result


@click.command("fit")
@click.argument("scene", metavar="SCENE", type=click.Path(path_type=Path))
@click.option(
    "--to", "target", required=True, multiple=True, callback=_to, metavar="PICTURE",
    help="Target, PNG or JPEG; FRAME=PICTURE, several times, or frame-%04d.png for frames of an animation.",
)  # fmt: skip
@click.option(
    "-o", "--out", metavar="OUT", help="Scene to write, with the values found as defaults; - prints it."
)
@options.text("--params", "NAME,…", "Params to find, instead of all that have a range.", multiple=True)
@options.text(
    "--start", "NAME=VALUE", "Value to begin with, instead of the param's default.", multiple=True,
    callback=options.assignments,
)  # fmt: skip
@options.request("defines", "frame", "model", "root")
@options.text("--mask", "PICTURE", "Picture that is bright where pixels count.")
@options.text("--crop", "WxH+X+Y", "Part of the target that shows the scene.", callback=_crop)
@options.text(
    "--background", "COLOR", "Colour behind what is transparent.", default="#ffffff", show_default=True,
    callback=_colour,
)  # fmt: skip
@click.option("--compare", metavar="OUT.png", help="Write a picture of before, after and target.")
@click.option("--animate", metavar="OUT.gif", help="Write an animation of the way to what was found.")
@options.count("--seed", low=0, high=2**31 - 1, default=0, help="Seed of the places to look at.")
@options.positive("--budget", "SECONDS", "Time after which nothing new is begun.", default=300.0)
def command(
    scene: Path,
    out: str | None,
    params: tuple[str, ...],
    request: options.Request,
    compare: str | None,
    animate: str | None,
    budget: float,
    **given: Any,  # arguments of `fit` by their names
) -> None:
    """Find the params of SCENE whose picture comes nearest to another picture.

    All params with a range are searched, colours if --params names them; -D keeps one at a value. OUT is
    SCENE with other defaults, all else as it was. The report says how near the picture is and how far each
    param is known. The exit code is 1 where the search did not come to an end.
    """
    from scenelang.drawing.exact.mesh import FitError
    from scenelang.inverse.fit import fit
    from scenelang.output.animate import animate as render
    from scenelang.output.frames import is_animation

    if compare is not None:
        targets(["compare"], compare)
    if animate is not None and not is_animation(animate):
        raise click.UsageError(f"`{animate}` names no animation, such as way.gif.")
    wanted = [name for listed in params for name in re.split(r"[,\s]+", listed) if name]
    source = request.source
    try:
        with Bar() as bar:
            result = fit(
                scene, params=wanted, fixed=source.values, model=source.model, root=source.root,
                frame=request.frame or 0, budget_s=budget, progress=bar, **given,
            )  # fmt: skip
    except FitError as error:
        raise Trouble(str(error)) from None
    if out is not None:
        put_out(result.text, out)
    if compare is not None:
        result.sheet().save(compare)
    if animate is not None:
        still = [result.way[0]] * 4, [result.way[-1]] * 8  # long enough to be looked at
        render(still[0] + list(result.way) + still[1], animate, fps=8)
    for line in result.told():
        click.echo(line, err=out == "-")
    if not result.done:
        raise click.exceptions.Exit(NOT_CONVERGED)
