"""What an animation need not evaluate again: statements that no frame changes are run once and replayed.

While a file is prepared, each statement's `Needs` collect what its value depends on. Evaluation has no side
effects that one statement could see of another, other than names and the block they fill. So a statement
that reaches neither ``t``, ``u`` nor ``frame`` gives the same nodes in every frame: the very same objects,
which later stages know again.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from scenelang.diagnostics.span import Span
from scenelang.evaluate.builder import Builder
from scenelang.evaluate.names import Needs
from scenelang.evaluate.session import Session
from scenelang.records import Record
from scenelang.scene.spans import SpanMap


class Replayed(Record, frozen=False):
    """The action of a statement of a file or a group that runs at most once in a frame.

    Args:
        action: runs it.
        needs: what it depends on.
        session: the evaluation.
        span: of the statement.
        varies: whether frames change it, once that was asked.
        kept: what it put into its block, the places of that, and the steps, objects and parts it counted.
    """

    action: Callable[[Any, Builder], None]
    needs: Needs
    session: Session
    span: Span
    varies: bool | None = None
    kept: tuple[Builder, SpanMap, int, int, int] | None = None

    def __call__(self, env: Any, out: Builder) -> None:
        """Run the statement, or replay what it did."""
        if self.varies is None:
            self.varies = self.needs.varies()
        session = self.session
        if self.varies:
            self.action(env, out)
        elif self.kept is None:
            own = Builder(out.material, out.material_span, out.moved)
            steps, objects, parts = session.steps, session.objects, session.parts
            around, session.spans = session.spans, SpanMap()
            try:
                self.action(env, own)
            finally:
                around.add(session.spans)
                spans, session.spans = session.spans, around
            own.material = own.material if out.material is None else None
            own.moved = own.moved if own.transforms else None
            counted = session.steps - steps, session.objects - objects, session.parts - parts
            self.kept = (own, spans, *counted)
            out.extend(own)
        else:
            own, spans, steps, objects, parts = self.kept
            if (own.children and out.moved) or (own.material and out.material):
                self.action(env, out)  # an error that needs the place it stands in
                return
            session.tick(steps, self.span)
            session.count_parts(parts, self.span)
            session.count_objects(objects, self.span)
            session.spans.add(spans)
            out.extend(own)
