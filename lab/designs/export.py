"""From a finished study or long training to weights that a model draws with."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

from lab.about import about
from lab.designs.long import LongTraining
from lab.designs.students import StreamingStudent, Student
from lab.designs.studies import StudentFile, Study
from lab.training.checkpoint import save_tensors
from scenelang.files import read_regular
from scenelang.models.load import RENDERER, Model, load_network
from scenelang.models.manifest import load_manifest
from scenelang.models.weights import MOST_BYTES, codes_of, open_weights


def export(study: Study, file: StudentFile, path: Path, device: str = "cpu") -> None:
    """Write the averaged weights of a study: the lifting's and the renderer's, without the levels of growing.

    They are stored in half precision, which is far finer than what such a training leaves undecided.

    Args:
        study: trained.
        file: the configuration it was made of.
        path: of the weights.
        device: that it was trained on.

    Raises:
        ValueError: the student is a framed one, whose weights `lab.training.loop` writes.
    """
    if study.config.student.renderer == "framed":
        raise ValueError("framed models are trained by a configuration with phases")
    header = {
        "model": file.model,
        "config": study.config.to_json(),
        "iteration": study.progress.step,
        "seconds": round(study.progress.seconds, 1),
        "device": device,
    }
    _write(study.averaged, path, header)


def export_long(training: LongTraining, model: str, path: Path) -> None:
    """The same of a long training, finished or not, with its curve: another can go on from the file."""
    header = {
        "model": model,
        "config": training.config.to_json(),
        "iteration": training.step,
        "seconds": round(training.seconds, 1),
        "curve": training.curve,
        "begun": training.begun,
        "device": "cpu",
    }
    _write(training.averaged, path, header)


def trained_model(path: Path) -> Model:
    """What draws with exported weights, whatever ships under their model's name.

    Scenes are compiled as for `shapes2d`, or of a learned lifting as for `shapes2d-reading`: on any canvas.
    """
    data = read_regular(path, MOST_BYTES)
    header = open_weights(data).header
    student = header["config"]["student"]
    side = student["streaming"]["resolution"]
    sizes = ((side, side),) if student["renderer"] == "streaming" else ()
    manifest = replace(
        load_manifest("shapes2d" if student["lifting"] == "exact" else "shapes2d-reading"),
        renderer=student["renderer"],
        sizes=sizes,
        white=True,
    )
    return Model(manifest, load_network(data, manifest), codes_of(manifest, data), header)


def _write(student: Student, path: Path, header: dict[str, Any]) -> None:
    levels, last = "none", ""
    if isinstance(student, StreamingStudent):
        levels = f"{RENDERER}stages."
        last = f"{levels}{student.renderer.config.resolution}."
    kept = {
        name: tensor.detach().half().cpu().contiguous()
        for name, tensor in student.state_dict().items()
        if not name.startswith(levels) or name.startswith(last)
    }
    save_tensors(path, kept, {"format": 1, **header, **about()})
