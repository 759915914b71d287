"""A frame of a clip is what its file gives by itself: nodes, Programs, places, warnings, mistakes."""

from __future__ import annotations

from pathlib import Path

import pytest

import scenelang as nsg
from scenelang.language.diagnostics import Diagnostics, SourceFile
from scenelang.language.evaluation import Source
from scenelang.language.reports import SceneError
from scenelang.output.frames import Clip
from tests.output.scenes import HEAD, TRICKY, examples, tricky


def compare(source: SourceFile, path: Path | None = None, step: int = 1) -> None:
    """In order, going back, and where frames are left out."""
    clip, back = Clip(Source(path, source)), Clip(Source(path, source))
    found, frames = Diagnostics(), range(0, clip.animation.frames, step)
    alone = {}
    for frame in frames:
        scene, spans = Source(path, source).scene(found, frame)
        assert scene is not None
        alone[frame] = scene, nsg.compile(scene, spans=spans, diagnostics=found)
    for drawn, order in ((clip, [*frames]), (back, [frames[at % len(frames)] for at in (4, 1, 5, 5, 0, 3)])):
        for frame in order:
            shot, (scene, program) = drawn.shot(frame), alone[frame]
            own = drawn.program(shot)
            assert shot.scene == scene
            assert (own.digest(), own.places) == (program.digest(), program.places)
            assert own.objects == program.objects
    assert {str(d) for d in clip.diagnostics} == {str(d) for d in found}


def test_frames_are_what_they_are_alone() -> None:
    for name in TRICKY:
        compare(SourceFile("a.nsg", tricky(name)))
    clip = Clip(Source(text=SourceFile("a.nsg", tricky("nothing moves"))))
    assert clip.program(clip.shot(0)) is clip.program(clip.shot(4))


@pytest.mark.parametrize("path", examples(), ids=lambda path: path.stem)
def test_frames_of_examples(path: Path) -> None:
    frames = Clip(Source(path)).animation.frames
    compare(SourceFile(str(path), path.read_text("utf-8")), path, max(1, frames // 3))


def test_imports_are_read_once(tmp_path: Path) -> None:
    (tmp_path / "lib.nsg").write_text("let k = 0.3; module m(x) { star { scale(k); rotate(1turn * x); } }")
    path = tmp_path / "a.nsg"
    path.write_text(HEAD + 'import "lib.nsg" as l; l.m(u); l.m(0.5);')
    source = SourceFile(str(path), path.read_text())
    compare(source, path)
    clip = Clip(Source(path))
    program = clip.program(clip.shot(1))
    (tmp_path / "lib.nsg").unlink()
    assert clip.program(clip.shot(1)).digest() == program.digest()
    assert tmp_path / "lib.nsg" in clip.wanted


def test_replays_see_the_place_they_stand_in() -> None:
    """A statement that stays is a mistake only beside what comes in a later frame."""
    for text in (
        "group { if (frame > 2) { scale(2); } star { scale(0.5); } rotate(9deg); }",
        "group { star; if (frame > 2) { material flat { color(#d33); } } material flat { color(#3d3); } }",
    ):
        source = SourceFile("a.nsg", HEAD + text)
        clip = Clip(Source(text=source))
        clip.program(clip.shot(0))
        found = Diagnostics()
        assert Source(text=source).scene(found, 4)[0] is None
        with pytest.raises(SceneError) as error:
            clip.shot(4)
        assert [(d.code, d.span) for d in error.value.diagnostics] == [(d.code, d.span) for d in found]


def test_another_rate_keeps_the_seconds() -> None:
    text = "animate(seconds = 2, fps = 10); square { translate(t, u); scale(frame + 1, frames); }"
    clip = Clip(Source(text=SourceFile("a.nsg", text), fps=4))
    assert (clip.animation.seconds, clip.animation.fps, clip.animation.frames) == (2, 4, 8)
    move, scale = clip.shot(6).scene.nodes[0].transforms
    assert (move.x, move.y, scale.x, scale.y) == (1.5, 0.75, 7, 8)


def test_loops_close_at_the_seam() -> None:
    """u = 1 shows what u = 0 shows, and no frame of the loop is either of them again."""
    body = "group {{ star {{ scale(0.4); translate(0.3, 0); rotate(1turn * {u}); }} rotate(2turn * {u}); }}"
    moving = HEAD + body.format(u="u")
    begin, end = (nsg.loads(f"let k = {k};" + body.format(u="k")) for k in (0, 1))
    a, b = nsg.compile(begin).vectors, nsg.compile(end).vectors
    assert abs(a - b).max() < 1e-6
    clip = Clip(Source(text=SourceFile("a.nsg", moving)))
    assert (clip.program(clip.shot(0)).vectors == a).all()
    digests = [clip.program(clip.shot(frame)).digest() for frame in range(clip.animation.frames)]
    assert len(set(digests)) == clip.animation.frames
    once = Clip(Source(text=SourceFile("a.nsg", moving.replace("fps = 6", "fps = 6, loop = false"))))
    assert abs(once.program(once.shot(5)).vectors - a).max() < 1e-6
