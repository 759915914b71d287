"""What an animation need not evaluate again: statements that no frame changes are run once and replayed.

While a file is prepared, each statement's `Needs` collect what its value depends on. Evaluation has no side
effects that one statement could see of another, other than names and the block they fill. So a statement
that reaches neither ``t``, ``u`` nor ``frame`` gives the same nodes in every frame: the very same objects,
which later stages know again.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from scenelang.diagnostics.span import Span
from scenelang.evaluate.builder import Builder
from scenelang.evaluate.names import Needs
from scenelang.evaluate.session import Session


@dataclass(slots=True)
class _Kept:
    """What a statement put into its block, and what it counted."""

    children: list[Any]
    transforms: list[Any]
    material: Any
    material_span: Any
    moved: Any
    spans: Any
    steps: int
    objects: int
    parts: int


@dataclass(slots=True)
class Still:
    """The action of a statement of a file or a group that runs at most once in a frame.

    Args:
        action: runs it.
        needs: what it depends on.
        session: the evaluation.
        span: of the statement.
    """

    action: Callable[[Any, Builder], None]
    needs: Needs
    session: Session
    span: Span
    varies: bool | None = None
    kept: _Kept | None = None

    def __call__(self, env: Any, out: Builder) -> None:
        """Run the statement, or replay what it did."""
        if self.varies is None:
            self.varies = self.needs.varies()
        if self.varies:
            self.action(env, out)
        elif self.kept is None:
            self._first(env, out)
        elif (self.kept.children and out.moved) or (self.kept.material and out.material):
            self.action(env, out)  # an error that needs the place it stands in
        else:
            self._again(out)

    def _first(self, env: Any, out: Builder) -> None:
        session = self.session
        children, transforms = len(out.children), len(out.transforms)
        material = out.material
        counted = session.steps, session.objects, session.parts
        around = session.spans
        session.spans = own = around.__class__()
        try:
            self.action(env, out)
        finally:
            session.spans = around
            around.add(own)
        self.kept = _Kept(
            out.children[children:],
            out.transforms[transforms:],
            out.material if out.material is not material else None,
            out.material_span,
            out.moved if len(out.transforms) > transforms else None,
            own,
            session.steps - counted[0],
            session.objects - counted[1],
            session.parts - counted[2],
        )

    def _again(self, out: Builder) -> None:
        kept, session = self.kept, self.session
        assert kept is not None
        session.tick(kept.steps, self.span)
        session.count_parts(kept.parts, self.span)
        session.count_objects(kept.objects, self.span)
        session.spans.add(kept.spans)
        out.children.extend(kept.children)
        out.transforms.extend(kept.transforms)
        if kept.material is not None:
            out.material, out.material_span = kept.material, kept.material_span
        out.moved = out.moved or kept.moved
