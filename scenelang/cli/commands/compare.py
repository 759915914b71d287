"""``scenelang compare``: network, reference and FLIP map of one scene side by side, with figures."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from scenelang.cli import inputs
from scenelang.cli.say import Bar, need_metrics

if TYPE_CHECKING:
    from scenelang.cli.inputs import Request
    from scenelang.drawing.how import How


@click.command("compare")
@click.argument("scene", metavar="SCENE")
@click.option(
    "-o", "--out", type=click.Path(path_type=Path), help="Picture to write; by default SCENE-compare.png."
)
@inputs.request
@inputs.originals
@inputs.drawing("device", "threads")
@click.pass_context
def command(ctx: click.Context, scene: str, out: Path | None, request: Request, how: How) -> None:
    """Draw SCENE with the network and exactly, and show where they differ.

    The exact picture takes longer than the network's, of solids minutes. Prints PSNR (at most 50 dB), SSIM
    and FLIP. Transparent pictures are compared over white.
    """
    from scenelang.cli.inputs import stem_of
    from scenelang.cli.jobs import composed, prepare_scene

    need_metrics()
    target = out if out is not None else composed(Path(f"{stem_of(scene)}-compare.png"))
    job = prepare_scene(scene, request)
    if job.program is None or job.scene is None or job.failed():
        ctx.exit(1)
    from scenelang.drawing.metrics import compare, over_white, side_by_side
    from scenelang.drawing.render import draw, draw_exact
    from scenelang.drawing.torch_backend import choose_device

    picture = over_white(draw(job.program, how, place=choose_device(how.device)).image)
    with Bar() as bar:
        exact = over_white(
            draw_exact(
                job.scene,
                spans=job.spans,
                progress=lambda share: bar("drawing the exact picture", share, 1),
            )
        )
    figures = compare(picture, exact)
    text = f"PSNR {figures['psnr']:.2f} dB  SSIM {figures['ssim']:.4f}  FLIP {figures['flip']:.4f}"
    side_by_side(picture, exact, text).save(target)
    click.echo(f"{text}  {target}")
