"""From a finished study to weights that a model draws with."""

from __future__ import annotations

from pathlib import Path

from scenelang.lab.about import about
from scenelang.lab.designs.students import StreamingStudent
from scenelang.lab.designs.studies import StudentFile, Study
from scenelang.models.load import RENDERER
from scenelang.training.checkpoint import save_tensors


def export(study: Study, file: StudentFile, path: Path, device: str = "cpu") -> None:
    """Write the averaged weights of a study: the lifting's and the renderer's, without the levels of growing.

    They are stored in half precision, which is far finer than what such a training leaves undecided.

    Args:
        study: trained.
        file: the configuration it was made of.
        path: of the weights.
        device: that it was trained on.

    Raises:
        ValueError: the student is a framed one, whose weights `scenelang.training.loop` writes.
    """
    student = study.averaged
    if study.config.student.renderer == "framed":
        raise ValueError("framed models are trained by a configuration with phases")
    levels = f"{RENDERER}stages." if isinstance(student, StreamingStudent) else "none"
    last = f"{RENDERER}stages.{study.config.student.streaming.resolution}."
    kept = {
        name: tensor.detach().half().cpu().contiguous()
        for name, tensor in student.state_dict().items()
        if not name.startswith(levels) or name.startswith(last)
    }
    header = {
        "format": 1,
        "model": file.model,
        "config": study.config.to_json(),
        "iteration": study.progress.step,
        "seconds": round(study.progress.seconds, 1),
        "device": device,
        **about(),
    }
    save_tensors(path, kept, header)
