"""Telling pages what changes in the folder."""

from __future__ import annotations

import asyncio
import logging
from pathlib import Path
from typing import Final

from watchfiles import Change, DefaultFilter, awatch

from scenelang.play.folder import Refused
from scenelang.play.shared import Play

log = logging.getLogger("scenelang.play")
STEP_MS: Final = 30  # a change is told once nothing has changed for so long
PATIENCE_S: Final = 0.3  # a file that is gone, or empty, may be in the middle of being written
SLOW_MS: Final = 1000  # between two looks where the system gives no notice


class _Filter(DefaultFilter):
    """Not what is hidden, and no temporary files of ours."""

    def __call__(self, change: Change, path: str) -> bool:
        return not Path(path).name.startswith(".") and super().__call__(change, path)


async def watch(play: Play, stop: asyncio.Event) -> None:
    """Tell pages of changes until ``stop``."""
    await asyncio.to_thread(play.folder.names)  # which finds whether it is large
    for polling in (False, True):
        try:
            changes = awatch(
                play.folder.path,
                watch_filter=_Filter(),
                debounce=300,
                step=STEP_MS,
                stop_event=stop,
                recursive=not play.folder.is_large and not polling,
                force_polling=polling or None,
                poll_delay_ms=SLOW_MS,
            )
            async for found in changes:
                play.later(_tell(play, {Path(path) for _, path in found}))
            return
        except (OSError, RuntimeError) as error:
            log.warning("the system does not tell of changes: %s", error)


async def _tell(play: Play, paths: set[Path]) -> None:
    names = {name for path in paths if (name := play.folder.name_of(path)) is not None}
    for name in names:
        if any(name in page.names for page in play.pages):
            await _reread(play, name)
    for page in play.pages:
        for path in paths:
            page.imported(path)
    if names or any(path.is_dir() or not path.exists() for path in paths):
        await play.refresh()


async def _reread(play: Play, name: str) -> None:
    for patient in (False, True):
        async with play.reading:
            try:
                text, disk = await asyncio.to_thread(play.folder.read, name)
            except Refused as error:
                log.warning("%s", error)
                return
            if text or patient:
                for page in play.pages:
                    page.changed(name, text, disk)
                return
        await asyncio.sleep(PATIENCE_S)
