"""A scene that runs in a page is the one that the compiler compiles, for any params and in any frame."""

from __future__ import annotations

import random
from pathlib import Path
from typing import Any

import pytest

from scenelang.diagnostics.error import SceneError
from scenelang.diagnostics.span import SourceFile
from tests.viewer.live import check_picture, compiled, defined, moved, pictures

pytestmark = pytest.mark.browser
ROOT = Path(__file__).parents[2]
EXAMPLES = [path for path in sorted(ROOT.glob("examples/**/*.nsg")) if path.name != "still.nsg"]


@pytest.mark.parametrize("path", EXAMPLES, ids=lambda path: path.stem)
def test_every_param_and_frame_of_the_examples(path: Path, viewer_page: Any) -> None:
    source = SourceFile(str(path), path.read_text())
    first = compiled(source, path)
    form, frames = first.form(), first.evaluation.frames
    assert not form.fixed
    cases = [({}, frame) for frame in sorted({0, 1 % frames, frames // 3, frames - 1})]
    pick = random.Random(path.name)
    for param in form.params:
        cases += [({param["name"]: value}, pick.randrange(frames)) for value in moved(param)]
    params = {param["name"]: param for param in form.params}
    inputs = [{"params": values, "frame": frame} for values, frame in cases]
    shown = pictures(viewer_page, [(form, inputs)])[0]
    for (values, frame), picture in zip(cases, shown, strict=True):
        given = {name: defined(params[name], value) for name, value in values.items()}
        try:
            expected = compiled(source, path, defines=given, frame=frame, model=first.manifest.name)
        except SceneError:
            assert isinstance(picture, str), (values, frame)
            continue
        assert isinstance(picture, dict), (picture, values, frame)
        check_picture(picture, expected, form)
