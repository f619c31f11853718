"""The stages of a study, in order.

    screen        design rows → forces → effects                           screen.json
    fit_surface   central composite rows → forces → regression, ANOVA      rsm.json
    invert        surface + target → parameters and how well known         invert.json
    validate      every diameter → measured against simulated              validate.json

A stage reads the file of the one before and leaves its own, so each can be run alone and again. Runs come
from the records of the study folder where they are there; statistics are always computed anew. Progress goes
to `watch`, called with a `Progress`.
"""

from __future__ import annotations

from concurrent.futures import Executor

from stemcal.solvers import make_solver
from stemcal.solvers.protocol import Request, Solver
from stemcal.stages.answering import Progress, Watch, answer_all, forces, ignore
from stemcal.stages.artefacts import (
    Stage,
    coding_entry,
    design_entry,
    head,
    leave,
    reasons_given,
    run_entry,
)
from stemcal.stages.audit import audit_screening, audit_surface, audit_validation, sentences
from stemcal.stages.layout import screening_design, surface_design, surface_factors
from stemcal.stages.lineage import read_fresh, stage_before
from stemcal.stages.planning import plan
from stemcal.stages.remarks import error_remark, sign_remarks, table_remarks
from stemcal.stages.turning import assess_published, solve
from stemcal.study.model import Study
from stemcal.study.store import StudyFolder

__all__ = ["Progress", "calibrate", "fit_surface", "invert", "plan", "screen", "validate"]


def calibrate(
    study: Study,
    folder: StudyFolder,
    executor: Executor,
    watch: Watch = ignore,
    solver: Solver | None = None,
) -> Stage:
    """Take a study through all stages; returns the validation, the others lie in the folder."""
    solver = solver or make_solver(study)
    with folder:
        screen(study, folder, executor, watch, solver)
        fit_surface(study, folder, executor, watch, solver)
        invert(study, folder, solver)
        return validate(study, folder, executor, watch, solver)


def screen(
    study: Study,
    folder: StudyFolder,
    executor: Executor,
    watch: Watch = ignore,
    solver: Solver | None = None,
) -> Stage:
    """Run the screening design and find the factors that move the force."""
    from stemcal.doe.screening import analyse_screening

    solver = solver or make_solver(study)
    with folder:
        design = screening_design(study, solver)
        requests = design.requests(study.targets.calibrate_at)
        answers = answer_all(requests, solver, folder, executor, watch)
        symbols = [factor.symbol for factor in study.factors]
        with reasons_given(requests, answers):
            result = analyse_screening(design.coded, forces(answers), design.names, symbols, study.screen.alpha)
        stage = head(study, solver, folder, "screen")
        stage["design"] = design_entry(design, requests, answers, solver)
        stage |= result.as_dict()
        stage["published"] = audit_screening(study, stage)
        stage["notes"] += sign_remarks(study, stage) + sentences(stage["published"])
        return leave(folder, stage)


def fit_surface(
    study: Study,
    folder: StudyFolder,
    executor: Executor,
    watch: Watch = ignore,
    solver: Solver | None = None,
) -> Stage:
    """Run the central composite design over the factors that matter and fit the response surface."""
    from stemcal.doe import surface

    solver = solver or make_solver(study)
    with folder:
        before = stage_before(study, "rsm")
        screening = read_fresh(study, solver, folder, before) if before else None
        names, chosen = surface_factors(study, solver, screening)
        design = surface_design(study, solver, names)
        requests = design.requests(study.targets.calibrate_at)
        answers = answer_all(requests, solver, folder, executor, watch)
        with reasons_given(requests, answers):
            result = surface.fit_surface(design.coded, forces(answers), names)
        stage = head(study, solver, folder, "rsm") | coding_entry(study, design)
        stage["design"] = design_entry(design, requests, answers, solver)
        stage |= result.as_dict()
        stage["pure_error_note"] = scatter = error_remark(stage)
        stage["published"] = audit_surface(study, stage)
        remarks = [scatter] if scatter and result.lack_of_fit_testable else []
        stage["notes"] = chosen + stage["notes"] + remarks + sentences(stage["published"])
        return leave(folder, stage)


def invert(study: Study, folder: StudyFolder, solver: Solver | None = None) -> Stage:
    """Solve the surface for the force measured at the calibration diameter."""
    solver = solver or make_solver(study)
    with folder:
        surface = read_fresh(study, solver, folder, "rsm")
        stage = head(study, solver, folder, "invert") | solve(study, surface)
        stage["published"], remarks = assess_published(study, surface)
        stage["notes"] += remarks
        return leave(folder, stage)


def validate(
    study: Study,
    folder: StudyFolder,
    executor: Executor,
    watch: Watch = ignore,
    solver: Solver | None = None,
) -> Stage:
    """Simulate every measured diameter with the calibrated parameters."""
    from stemcal.doe.validation import compare_diameters

    solver = solver or make_solver(study)
    with folder:
        parameters = read_fresh(study, solver, folder, "invert")["parameters"]
        targets = study.targets.forces
        requests = [Request("validate", row, parameters, target.diameter) for row, target in enumerate(targets)]
        answers = answer_all(requests, solver, folder, executor, watch)
        result = compare_diameters(
            [target.diameter for target in targets],
            [target.force for target in targets],
            [answer.force for answer in answers],
            study.targets.calibrate_at,
        )
        stage = head(study, solver, folder, "validate") | {"parameters": parameters} | result.as_dict()
        for row, request, answer in zip(stage["rows"], requests, answers, strict=True):
            entry = run_entry(request, answer, solver)
            row |= {name: entry[name] for name in ("status", "reason", "message", "key")}
        stage["published"] = audit_validation(study)
        stage["notes"] += table_remarks(study, solver) + sentences(stage["published"])
        return leave(folder, stage)
