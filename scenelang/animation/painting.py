"""Frames to pictures, in this process."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import lru_cache
from importlib.metadata import version
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple, get_args

from scenelang.animation.clip import Clip, Shot
from scenelang.animation.store import frame_key

if TYPE_CHECKING:
    from scenelang.backend.options import Backend, Device
    from scenelang.image import Image
    from scenelang.outputs import Output
    from scenelang.program.program import Program
    from scenelang.renderers.draw import Kept

DRAFT = 4  # pixels across that one of a draft stands for
Progress = Callable[[float], None]
_version = lru_cache(version)


@dataclass(frozen=True, slots=True)
class Drawable:
    """A frame ready to be drawn."""

    number: int  # from 0
    key: str  # digest of all that decides its pixels
    shot: Shot  # the frame
    program: Program | None  # what the network draws; None for the reference
    small: bool = False  # whether numpy draws it


@dataclass(slots=True)
class Painter:
    """Draws a clip's frames."""

    clip: Clip  # the animation
    backend: Backend = "neural"
    device: Device = "auto"  # where the network runs
    threads: int | None = None  # tiles drawn at the same time; by default as for `scenelang.render`
    # the picture before, of which what is the same is taken over
    kept: Kept | None = field(default=None, repr=False)
    outputs: tuple[Output, ...] = ()  # beside each picture
    single: bool = False  # draw each as it is drawn by itself: small ones by numpy
    load_s: float = 0.0  # what loading torch took

    def __post_init__(self) -> None:
        from scenelang.backend.options import Backend

        if self.backend not in get_args(Backend):
            known = " and ".join(f"`{name}`" for name in get_args(Backend))
            raise ValueError(f"unknown backend `{self.backend}` of animations; there are {known}")

    def prepare(self, shot: Shot, *, single: bool = False) -> Drawable:
        """Compile a frame and say what its files depend on; raises as `Clip.program`, or `RenderError`.

        Torch draws animations; numpy draws solids, and a small picture by itself (``single``).
        """
        found = self._picture(shot, single or self.single)
        if not self.outputs:
            return found
        # they tell of each object which it is and where it was written
        program = found.program
        places: tuple[object, ...] = (self.clip.texts,)
        if program is not None:
            places = program.numbers, program.objects, program.places
        return replace(found, key=frame_key(found.key, self.outputs, *places))

    def _picture(self, shot: Shot, single: bool) -> Drawable:
        if self.backend == "reference":
            scene = shot.scene.model_copy(update={"animation": None})
            key = frame_key("reference", _version("scenelang"), self.clip.model, scene.to_json())
            return Drawable(shot.number, key, shot, None)
        program = self.clip.program(shot)
        if single or program.stage is not None:
            from scenelang.backend.small import choose_drawer

            if choose_drawer(program, self.device).library == "numpy":
                cores = () if program.stage is None else (self.split(program),)
                key = frame_key("numpy", _version("scenelang"), _version("numpy"), *cores, program.digest())
                return Drawable(shot.number, key, shot, program, small=True)
        key = frame_key(
            "neural",
            *(_version("scenelang"), _version("torch"), self.place, self.split(program), program.digest()),
        )
        return Drawable(shot.number, key, shot, program)

    @property
    def place(self) -> str:
        """The torch device."""
        started = time.perf_counter()
        from scenelang.backend.neural import choose_device

        self.load_s += time.perf_counter() - started
        return choose_device(self.device)

    def split(self, program: Program) -> int:
        """How many threads a picture is split for, which shows in the last bits of its pixels."""
        if self.threads is not None:
            return self.threads
        from scenelang.backend.options import threads_for

        return threads_for(program.canvas)

    def draw(self, frame: Drawable, progress: Progress | None = None) -> Image:
        """Draw a frame; the same picture as `scenelang.render` gives for it on this device, bit for bit."""
        if frame.program is None:
            from scenelang.backend.render import draw_exact

            return draw_exact(frame.shot.scene, spans=frame.shot.spans, model=self.clip.model)
        from scenelang.renderers.draw import Kept

        if self.kept is None and self.clip.reuse:
            self.kept = Kept()
        place, split = None if frame.small else self.place, self.split(frame.program)
        return paint(frame.program, place, threads=split, split=split, kept=self.kept, progress=progress)

    def draft(self, frame: Drawable) -> Image | None:
        """A coarse picture of solids in the frame's size, for about a twentieth of the work; else None."""
        program = frame.program
        if program is None or program.stage is None or min(program.canvas) < DRAFT * DRAFT:
            return None
        from scenelang.backend.small import draw_small
        from scenelang.image import enlarged

        width, height = program.canvas
        coarse = replace(program, canvas=(-(-width // DRAFT), -(-height // DRAFT)))
        return enlarged(draw_small(coarse, samples="one", threads=self.threads).image, program.canvas)

    def files(self, frame: Drawable, file: Path, progress: Progress | None = None) -> dict[Path, bytes]:
        """What the picture's file holds and those of its outputs; raises as `scenelang.render_outputs`."""
        from scenelang.backend.outputs import exact_outputs, neural_outputs
        from scenelang.image import packed
        from scenelang.outputs import Outputs

        found = Outputs()
        if self.outputs and frame.program is not None:
            found = neural_outputs(frame.program, self.outputs, self.threads)
        elif self.outputs:
            shot, model = frame.shot, self.clip.model
            found = exact_outputs(shot.scene, self.outputs, spans=shot.spans, model=model)
        return packed(self.draw(frame, progress), found, file)


class Errand(NamedTuple):
    """A frame that another process draws, by one thread; its fields are what JSON holds."""

    file: str  # where its picture goes, which names the format
    place: str | None  # torch device, or None for numpy
    split: int  # threads that the picture is split for
    outputs: tuple[Output, ...]  # beside it

    def run(self, program: bytes, kept: Kept) -> dict[Path, bytes]:
        """What the files of a Program's bytes hold; raises as `scenelang.render_outputs`."""
        from scenelang.backend.outputs import neural_outputs
        from scenelang.image import packed
        from scenelang.outputs import Outputs
        from scenelang.program.reading import parse_program

        if self.place is not None:
            from scenelang.backend.neural import choose_device

            choose_device(self.place)
        read = parse_program(program)
        found = neural_outputs(read, self.outputs, 1) if self.outputs else Outputs()
        image = paint(read, self.place, threads=1, split=self.split, kept=kept)
        return packed(image, found, Path(self.file))


def paint(
    program: Program,
    place: str | None,
    *,
    threads: int,
    split: int,
    kept: Kept | None,
    progress: Progress | None = None,
) -> Image:
    """Draw a Program on a torch device, or by numpy where that is None.

    The picture is split for so many threads, of which so many draw at the same time.
    """
    if place is None:
        from scenelang.backend.small import draw_small

        return draw_small(program, kept=kept, progress=progress, threads=threads, split=split).image
    from scenelang.backend.neural import draw_program, open_model

    model = open_model(program.model, place, program.weights)
    return draw_program(program, model, threads=threads, split=split, kept=kept, progress=progress).image
