"""Frames to pictures, in this process."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import lru_cache
from importlib.metadata import version
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from scenelang.animation.clip import Clip, Shot
from scenelang.animation.store import frame_key
from scenelang.backend.options import DEFAULT, How

if TYPE_CHECKING:
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
    place: str = "cpu"  # who draws it: numpy, or a torch device


@dataclass(slots=True)
class Painter:
    """Draws a clip's frames."""

    clip: Clip  # the animation
    how: How = DEFAULT  # how they are drawn
    # the picture before, of which what is the same is taken over
    kept: Kept | None = field(default=None, repr=False)
    outputs: tuple[Output, ...] = ()  # beside each picture
    single: bool = False  # draw each as it is drawn by itself: small ones by numpy
    load_s: float = 0.0  # what loading torch took

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
        if self.how.backend == "reference":
            scene = shot.scene.model_copy(update={"animation": None})
            key = frame_key("reference", _version("scenelang"), scene.to_json())
            return Drawable(shot.number, key, shot, None)
        program = self.clip.program(shot)
        place = self._place(program, single)
        library = place if place == "numpy" else "torch"
        cores = () if place == "numpy" and program.stage is None else (self.split(program),)
        way = self.how.backend, *self.how.care.values()
        key = frame_key(place, _version("scenelang"), _version(library), *way, *cores, program.digest())
        return Drawable(shot.number, key, shot, program, place)

    def _place(self, program: Program, single: bool) -> str:
        """The library or device that draws a Program: numpy, or a torch device."""
        how = self.how
        if single or program.stage is not None or how.backend == "exact":
            from scenelang.backend.small import choose_drawer

            drawer = choose_drawer(program, how.device, how.samples, exact=how.backend == "exact")
            if drawer.library == "numpy":
                return "numpy"
        started = time.perf_counter()
        from scenelang.backend.neural import choose_device

        self.load_s += time.perf_counter() - started
        return choose_device(how.device)

    def split(self, program: Program) -> int:
        """How many threads a picture is split for, which shows in the last bits of its pixels."""
        if self.how.threads is not None:
            return self.how.threads
        from scenelang.backend.options import threads_for

        return threads_for(program.canvas)

    def draw(self, frame: Drawable, progress: Progress | None = None) -> Image:
        """Draw a frame; the same picture as `scenelang.render` gives for it on this device, bit for bit."""
        if frame.program is None:
            from scenelang.backend.render import draw_exact

            return draw_exact(frame.shot.scene, spans=frame.shot.spans)
        from scenelang.backend.render import draw
        from scenelang.renderers.draw import Kept

        if self.kept is None and self.clip.reuse:
            self.kept = Kept()
        split = self.split(frame.program)
        how = self.how._replace(threads=split)
        return draw(
            frame.program, how, place=frame.place, split=split, kept=self.kept, progress=progress
        ).image

    def draft(self, frame: Drawable) -> Image | None:
        """A coarse picture of solids in the frame's size, for about a twentieth of the work; else None."""
        program = frame.program
        if program is None or program.stage is None or min(program.canvas) < DRAFT * DRAFT:
            return None
        from scenelang.backend.small import draw_small
        from scenelang.image import enlarged

        width, height = program.canvas
        coarse = replace(program, canvas=(-(-width // DRAFT), -(-height // DRAFT)))
        return enlarged(draw_small(coarse, samples="one", threads=self.how.threads).image, program.canvas)

    def files(self, frame: Drawable, file: Path, progress: Progress | None = None) -> dict[Path, bytes]:
        """What the picture's file holds and those of its outputs; raises as `scenelang.render_outputs`."""
        from scenelang.backend.outputs import outputs_of
        from scenelang.image import packed

        shot, drawn = frame.shot, frame.program or frame.shot.scene
        found = outputs_of(drawn, self.outputs, self.how, spans=shot.spans)
        return packed(self.draw(frame, progress), found, file)


class Errand(NamedTuple):
    """A frame that another process draws, by one thread; its fields are what JSON holds."""

    file: str  # where its picture goes, which names the format
    place: str  # numpy, or a torch device
    split: int  # threads that the picture is split for
    outputs: tuple[Output, ...] = ()  # beside it
    how: How = DEFAULT  # how it is drawn

    def run(self, program: bytes, kept: Kept) -> dict[Path, bytes]:
        """What the files of a Program's bytes hold; raises as `scenelang.render_outputs`."""
        from scenelang.backend.outputs import outputs_of
        from scenelang.backend.render import draw
        from scenelang.image import packed
        from scenelang.program.reading import parse_program

        read, how = parse_program(program), How(*self.how)._replace(threads=1)
        image = draw(read, how, place=self.place, split=self.split, kept=kept).image
        return packed(image, outputs_of(read, self.outputs, how), Path(self.file))
