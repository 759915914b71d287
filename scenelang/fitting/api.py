"""``scenelang.learn``: files made elements in one call."""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Sequence
from typing import Literal

from scenelang.fitting import learn as making
from scenelang.fitting.making import Wish
from scenelang.fitting.mesh import FitError as FitError
from scenelang.fitting.mesh import Sign
from scenelang.scene.elements import Elements, load_elements


def learn(
    files: str | os.PathLike[str] | Sequence[str | os.PathLike[str]],
    out: str | os.PathLike[str],
    *,
    name: str | None = None,
    max_error: float | None = None,
    budget_s: float = math.inf,
    steps: int | None = None,
    license: str | None = None,
    source: str | None = None,
    sign: Sign = "auto",
    pictures: Literal["texture", "outline"] = "texture",
    parts: bool | None = None,
    cluster: str | None = None,
    say: Callable[[str], None] = lambda line: None,
) -> Elements:
    """Make files elements, as ``scenelang learn`` does: ``learn("cow.obj", "zoo.safetensors")``.

    What ``out`` holds stays beside them; what was made before of the same file and in the same way is kept.

    Args:
        files: meshes, drawings and pictures, or one.
        out: a file of elements, which may exist.
        name: of the one element; by default that of the file.
        max_error: how far off is near enough, by default what the command says.
        budget_s: for each file; nothing new is begun after so many seconds.
        steps: forms that are tried at most, whatever the time; the same number gives the same bytes.
        license, source: of the originals, kept in the file.
        sign: what tells inside of a mesh.
        pictures: whether they become textures or geometries.
        parts: whether those of a file are elements of their own; if left out, those of drawings are.
        cluster: address of a dask scheduler whose workers make them, several at a time, or ``"local"``; needs
            the extra ``dask``, and what makes elements on each.
        say: is told in lines what is found and tried; by workers, of a file when it is done.

    Returns:
        All elements of ``out``, for a Scene.

    Raises:
        FitError: files cannot be made elements, a line for each; the others were.
        RenderError: ``cluster`` has no workers, or they differ from this machine.
        OSError: ``out`` cannot be read or written.
        ValueError: names that scenes cannot say, or twice the same.
    """
    wish = Wish(
        sign=sign, max_error=max_error, budget_s=budget_s, steps=steps,
        license=license, source=source, pictures=pictures, parts=parts,
    )  # fmt: skip
    listed = [files] if isinstance(files, str | os.PathLike) else files
    making.learn(listed, out, wish, name=name, cluster=cluster, say=say)
    return load_elements(os.fspath(out))
