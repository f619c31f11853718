"""The closed loop on a Gaussian process: batches of points simulated together, where a quadratic bends too little."""

from stemcal.doe.calibration.infill import next_batch, possible
from stemcal.doe.regression.gaussian_process import GaussianProcess, clearly_better, fit_process
from stemcal.stages.refine.loop import Loop
from stemcal.stages.refine.result import LearntProcess
from stemcal.stages.surface.result import SurfaceResult
from stemcal.study.model import RefineOptions, Study


def takes_process(study: Study, surface: SurfaceResult) -> bool:
    """Whether a Gaussian process proposes the points: asked for, or better at the runs left out where that decides."""
    model, opinion = (study.refine or RefineOptions()).model, surface.second_opinion
    if model != "better" or opinion is None:
        return model == "process"
    return clearly_better(opinion.polynomial_predicted_r2, opinion.process_predicted_r2)


class ProcessLoop(Loop):
    """The loop to one force; the process is fitted anew after each batch."""

    def run(self) -> None:
        """Go on until a force is right, the budget is spent, or the process proposes nothing new."""
        self._visit([self.coding.point(self.solution.point.coded)], "solution")
        while True:
            if any((entry.max_abs_error_percent or 0.0) <= self.options.tolerance_percent
                   for entry in self.iterations if entry.misfit is not None):  # fmt: skip
                self.stopped = "tolerance"
                return
            count = min(self.options.batch, self.options.budget - len(self.rows))
            batch = next_batch(self._process(), self.solution.target, self.region, count) if count > 0 else []
            if not batch:
                return
            self._visit(batch, "process")

    def _process(self) -> GaussianProcess:
        fitted = self.surfaces[0]
        return fit_process(fitted.design, fitted.response)

    def _model(self, i: int) -> GaussianProcess:
        return self._process()

    def learnt(self) -> LearntProcess:
        """Return the process that has learnt from all runs, and where it leaves the target possible."""
        process, names = self._process(), self.coding.names
        ends = self.coding.to_natural(possible(process, self.solution.target, self.region).T).T
        return LearntProcess(
            scales=dict(zip(names, process.scales.tolist(), strict=True)),
            q2=process.q2,
            quadratic_q2=self.surface.predicted_r2,
            runs=len(process.response),
            ranges={name: (float(a), float(b)) for name, (a, b) in zip(names, ends, strict=True)},
        )
