"""Figures drawn by the worker processes of this machine, several at a time and while there is nothing to simulate."""

from __future__ import annotations

import pickle
from collections.abc import Sequence
from concurrent.futures import Future
from types import TracebackType
from typing import TYPE_CHECKING

from stemcal.executors.base import RunExecutor
from stemcal.executors.failures import WorkerDied
from stemcal.executors.local import LocalExecutor

if TYPE_CHECKING:
    from stemcal.report.figures.gallery import Plot

_MANY = 15  # figures that take longer than two processes need to start and to load what drawing needs


class Drawers:
    """The workers of an executor, as far as they draw; the figures are the same to the byte.

    A figure is known by all that it is made of: one that was begun early and is made of something else in the end is
    drawn again. Where there is one worker, or none on this machine, nothing is drawn here.
    """

    def __init__(self, executor: RunExecutor | None) -> None:
        self._executor = executor if isinstance(executor, LocalExecutor) and executor.workers > 1 else None
        self._begun: dict[bytes, Future[tuple[str, bytes]]] = {}

    def __enter__(self) -> Drawers:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Draw nothing that nobody has asked for."""
        for future in self._begun.values():
            future.cancel()

    @property
    def at_work(self) -> bool:
        """Whether there are workers already."""
        return self._executor is not None and self._executor.started

    def begin(self, plots: Sequence[Plot]) -> None:
        """Have figures drawn while there is nothing to simulate, those made of most first."""
        if self._executor is not None and self._executor.started:
            self._submit(plots, self._executor)

    def draw(self, plots: Sequence[Plot]) -> None:
        """Have the figures drawn, and wait for them.

        If workers would have to start for a few, figures are left to be drawn where they are asked for; so is one whose
        worker dies over it.
        """
        if self._executor is None or (not self._executor.started and len(plots) < _MANY):
            return
        for plot, future in zip(plots, self._submit(plots, self._executor), strict=True):
            try:
                plot.take(*future.result())
            except WorkerDied:
                continue

    def _submit(self, plots: Sequence[Plot], executor: LocalExecutor) -> list[Future[tuple[str, bytes]]]:
        """Return for each figure what will be drawn, queued unless it is already."""
        blobs = [pickle.dumps((drawn, (plot,), {})) for plot in plots]
        for blob in sorted(blobs, key=len, reverse=True):
            if blob not in self._begun:
                self._begun[blob] = executor.submit_pickled(blob, time_limit=None, when_idle=True)
        return [self._begun[blob] for blob in blobs]


def drawn(plot: Plot) -> tuple[str, bytes]:
    """Return a figure as SVG and PNG. Runs in a worker."""
    return plot.document, plot.pixels
