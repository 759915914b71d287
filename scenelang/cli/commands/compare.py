"""``scenelang compare``: network, reference and FLIP map of one scene side by side, with figures."""

from __future__ import annotations

from functools import partial
from pathlib import Path

import click

from scenelang.cli import options
from scenelang.cli.files import composed, shown, stem_of
from scenelang.cli.say import Bar, need_metrics
from scenelang.drawing.how import How


@click.command("compare")
@click.argument("scene", metavar="SCENE")
@options.writes(
    "OUT", "Picture to write; by default SCENE-compare.png, - is standard output.", ".png", required=False
)
@options.request()
@options.originals
@options.drawing("device", "threads")
@click.pass_context
def command(ctx: click.Context, scene: str, out: str | None, request: options.Request, how: How) -> None:
    """Draw SCENE with the network and exactly, and show where they differ.

    The exact picture takes longer than the network's, of solids minutes. Prints PSNR (at most 50 dB), SSIM
    and FLIP. Transparent pictures are compared over white.
    """
    from scenelang.cli.inputs import prepare_scene

    need_metrics()
    target = composed(Path(f"{stem_of(scene)}-compare.png")) if out is None else Path(out)
    job = prepare_scene(scene, request)
    if job.program is None or job.scene is None or job.failed():
        ctx.exit(1)
    from scenelang.drawing.metrics import compare, over_white, side_by_side
    from scenelang.drawing.render import draw, draw_exact

    picture = over_white(draw(job.program, how).image)
    with Bar() as bar:
        progress = partial(bar, "drawing the exact picture", total=1)
        exact = over_white(draw_exact(job.scene, spans=job.spans, patient=how.patient, progress=progress))
    figures = compare(picture, exact)
    text = f"PSNR {figures['psnr']:.2f} dB  SSIM {figures['ssim']:.4f}  FLIP {figures['flip']:.4f}"
    side_by_side(picture, exact, text).save(target)
    click.echo(f"{text}  {shown(target)}", err=shown(target) != str(target))
