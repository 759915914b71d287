"""Command lines that are refused: the exit code, the words, and that nothing is written."""

from __future__ import annotations

import os
import shlex

from tests.cli.conftest import GOOD, Folder

MOVING = "animate(1, 4); canvas(16, 16); star { scale(0.6); rotate(0.1turn * u); }\n"
SOLIDS = "canvas(24, 16);\nsphere { scale(0.5); }\n"
SCENES = {
    "a": GOOD,
    "b": "canvas(16, 16);" + GOOD,
    "b/a": GOOD,
    "moving": MOVING,
    "late": MOVING.replace("0.6", "2 - frame"),
    "solids": SOLIDS,
    "orbit": "animate(1, 3); camera(eye = [6 * sin(1turn * u), 1, 5]);\n" + SOLIDS,
    "learned": 'model "shapes2d-streaming"; canvas(64, 64); background(#fff); square { }',
    "wrong": "square { scale(foo); }",
    "grown": "animate(1, 4); square { scale(0.2 + 0.1 * u); }\n",
}
# The command; its exit code; a part of what it says on standard error, on one line.
REFUSED = """
render a.nsg -o a.xyz                              | 2 | suffix `.xyz`
render a.nsg -o a                                  | 2 | a folder ends in a slash
render a.nsg -o none/a.png                         | 2 | no folder `none`
render a.nsg b/a.nsg -o out                        | 2 | both be written to
render a.nsg b.nsg -o a.nsg                        | 2 | is a file
render a.nsg b.nsg -o out.png                      | 2 | names a picture
render a.nsg -o a.png --size 3                     | 2 | not a size such as
render a.nsg -o a.png --size 9000x1                | 2 | outside 1..8192
render moving.nsg -o a.png --frames 0..1           | 2 | holds one picture
render moving.nsg -o a.gif --frames x              | 2 | not a range of frames
render moving.nsg -o a.gif --frames 2..9           | 1 | frame 9 is outside 0..3
render moving.nsg -o a.gif --frame 1 --frames 2    | 2 | --frame asks for a picture
render moving.nsg b.nsg -o out --fps 3             | 2 | take one scene
render moving.nsg b.nsg -o a.mp4                   | 2 | names an animation
render moving.nsg -o none/a.gif                    | 2 | no folder `none`
render moving.nsg -o a.gif --fps 0                 | 2 | --fps
render moving.nsg -o a.gif --fps nan               | 2 | `nan` is not a number
render moving.nsg -o a.gif --fps 5e-324            | 2 | frames a second, where
render b.nsg -o a.gif --fps 3                      | 1 | --fps for a scene without animate
render b.nsg -o a.gif --frames 0..                 | 1 | --frames for a scene without animate
render b.nsg -o a.mp4                              | 2 | has no animate
render late.nsg -o a.gif                           | 1 | E0312
render a.nsg -o p.png --output depth               | 2 | a 2D picture has no depth; it has object and alpha
render solids.nsg -o p.jpg --output depth          | 2 | outputs go with .png or .exr pictures, not `p.jpg`
render orbit.nsg -o p.gif --output depth           | 2 | `p.gif` is one file
render orbit.nsg -o f-%d.jpg --output depth        | 2 | outputs go with .png or .exr pictures, not `f-0.jpg`
render solids.nsg -o p.png --prove                 | 2 | solids are not proved
render learned.nsg -o p.png --prove                | 2 | learned where points lie
render a.nsg -o p.png --prove --backend reference  | 2 | pictures are exact
render a.nsg -o p.png --prove --backend exact      | 2 | leave out --backend exact
render a.nsg -o p.png --prove --max-ms 5           | 2 | leave out --max-ms
render moving.nsg -o p-%d.png --prove --frames 0..1 | 2 | a proof is for single pictures
render a.nsg -o a.png --max-ms 9 --backend exact   | 2 | --max-ms chooses how to draw
render a.nsg -o a.png --max-ms 9 --samples one     | 2 | leave out --backend and --samples
render a.nsg -o a.png --max-ms 9 --device cuda     | 2 | leave out --device cuda
render a.nsg -o a.png --max-flip 2                 | 2 | 2.0 is not in the range
render a.nsg -o a.png --backend reference --samples one | 2 | the reference always takes all samples
render a.nsg -o a.png --backend exact --device cuda | 2 | not by device cuda
render grown.nsg -o a.gif --max-ms 20              | 2 | for single pictures; --frame draws one
watch none.nsg                                     | 2 | there is no file `none.nsg`
watch a.nsg -o a.xyz                               | 2 | suffix `.xyz`
watch a.nsg -o a.png --frames 0..3                 | 2 | holds one picture
compile a.nsg -o a.png                             | 2 | ends in .safetensors
compile a.nsg -o none/a.safetensors                | 2 | none/a.safetensors
compile wrong.nsg -o a.safetensors                 | 1 | E0201
compile none.nsg -o a.safetensors                  | 2 | none.nsg: no such file
check a.nsg -D k                                   | 2 | not NAME=value
check a.nsg --ignore E0302                         | 2 | errors always count
check a.nsg --select W99                           | 2 | no code begins with
check a.nsg --frame 1 --all-frames                 | 2 | exclude each other
dump a.nsg --after syntax --format mmd             | 2 | The syntax tree has no drawing
dump a.nsg --format dot --diff                     | 2 | A drawing is of one stage
dump a.nsg --costs --diff                          | 2 | leave out --after, --diff and drawings
dump wrong.nsg -o b.dot                            | 1 | E0201
dump wrong.nsg --costs                             | 1 | E0201
convert a.nsg -o a.py                              | 2 | --to nsg or json
export a.nsg -o a.png                              | 2 | .html; `scenelang render` writes other files
render a.nsg -o a.html                             | 2 | suffix `.html`; `scenelang export` writes other files
render a.nsg -o - --format foo                     | 2 | cannot write `standard output`: no image format
render a.nsg -o a.png --format png                 | 2 | --format is for standard output
render a.nsg a.nsg -o -                            | 2 | `standard output` names a picture
render a.nsg -o - --output alpha                   | 2 | standard output takes them as exr
render wrong.nsg -o -                              | 1 | E0201
export a.nsg -o a                                  | 2 | a page has a suffix such as .html
export a.nsg -o no/a.html                          | 2 | no folder
export a.nsg a.nsg -o out --title T                | 2 | --title is of one page
models shapes                                      | 2 | No model `shapes`
explain E9999                                      | 2 | No code `E9999`
chekc                                              | 2 | Did you mean `check`?
graph a.nsg                                        | 2 | `scenelang dump --format mmd`
import flower.glb                                  | 2 | is gone: `scenelang learn --parts` makes elements
lab shapes2d                                       | 2 | `lab` is now `python -m lab`.
train shapes2d                                     | 2 | `train` is now `python -m lab train`.
"""


def test_what_is_refused(folder: Folder) -> None:
    for name, text in SCENES.items():
        folder.write(f"{name}.nsg", text)
    before, wrong = sorted(os.listdir()), []
    for row in REFUSED.strip().splitlines():
        command, code, words = (part.strip() for part in row.split(" | "))
        result = folder.run(*shlex.split(command))
        said, left = " ".join(result.stderr.split()), [n for n in sorted(os.listdir()) if n[0] != "."]
        if result.exit_code != int(code) or words not in said or left != before:
            wrong.append(f"{command}: {result.exit_code}, {said}, {set(left) - set(before)}")
    assert not wrong, "\n".join(wrong)
