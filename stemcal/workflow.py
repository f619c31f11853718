"""The stages of a study, in order.

    screen        design rows → forces → effects                           screen.json
    climb         steps towards the target, if the spec asks for them      climb.json
    fit_surface   central composite rows → forces → regression, ANOVA      rsm.json
    invert        surface + target → parameters and how well known         invert.json
    refine        simulate at the solution, correct it, again              refine.json
    validate      every diameter → measured against simulated              validate.json
    audit         printed tables and claims against recomputed ones        audit.json

A stage reads the file of the one before and leaves its own, so each can be run alone and again. Runs come
from the records of the study folder where they are there; statistics are always computed anew. Progress goes
to `watch`, called with a `Progress`.
"""

from __future__ import annotations

from concurrent.futures import Executor
from functools import partial

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
from stemcal.stages.auditing import audit_all, require_printed_runs
from stemcal.stages.climbing import climb_to_target, recentred
from stemcal.stages.joining import further_responses, run_diameters, solve_jointly
from stemcal.stages.layout import screening_design, surface_design, surface_factors
from stemcal.stages.lineage import read_fresh, stage_before
from stemcal.stages.planning import plan
from stemcal.stages.policy import censored_remarks
from stemcal.stages.refining import close_loop
from stemcal.stages.refining_jointly import close_jointly
from stemcal.stages.remarks import error_remark, sign_remarks, table_remarks
from stemcal.stages.stepping import simulating, simulating_at
from stemcal.stages.surfacing import beside, fit_terms
from stemcal.stages.turning import assess_published, solve, weighed
from stemcal.study.model import Study
from stemcal.study.store import StudyFolder

__all__ = ["Progress", "audit", "calibrate", "climb", "fit_surface", "invert", "plan", "refine", "screen", "validate"]


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
        if study.climb is not None:
            climb(study, folder, executor, watch, solver)
        fit_surface(study, folder, executor, watch, solver)
        invert(study, folder, solver)
        if study.refine is not None:
            refine(study, folder, executor, watch, solver)
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
        stage = head(study, solver, folder, "screen")
        design = screening_design(study, solver)
        requests = design.requests(study.targets.calibrate_at)
        answers = answer_all(requests, solver, folder, executor, watch, study.runs)
        symbols = [factor.symbol for factor in study.factors]
        with reasons_given(requests, answers):
            result = analyse_screening(
                design.coded,
                forces(answers),
                design.names,
                symbols,
                study.screen.alpha,
                study.screen.error,
                {factor.name: factor.expected_sign for factor in study.factors if factor.expected_sign},
            )
        stage["design"] = design_entry(design, requests, answers, solver)
        stage |= result.as_dict()
        stage["published"] = audit_screening(study, stage)
        stage["notes"] += censored_remarks(answers) + sign_remarks(study, stage) + sentences(stage["published"])
        return leave(folder, stage)


def climb(
    study: Study,
    folder: StudyFolder,
    executor: Executor,
    watch: Watch = ignore,
    solver: Solver | None = None,
) -> Stage:
    """Step the active factors together towards the target, and centre the surface's design on the best step."""
    solver = solver or make_solver(study)
    with folder:
        simulate = simulating("climb", study, solver, folder, executor, watch)
        screening = read_fresh(study, solver, folder, "screen")
        stage = head(study, solver, folder, "climb") | climb_to_target(study, solver, screening, simulate)
        return leave(folder, stage)


def fit_surface(
    study: Study,
    folder: StudyFolder,
    executor: Executor,
    watch: Watch = ignore,
    solver: Solver | None = None,
) -> Stage:
    """Run the design of the surface over the factors that matter and fit it."""
    solver = solver or make_solver(study)
    with folder:
        before = stage_before(study, "rsm")
        screening = read_fresh(study, solver, folder, before) if before else None
        stage = head(study, solver, folder, "rsm")
        names, chosen = surface_factors(study, solver, screening)
        centred = recentred(study, screening)
        design = surface_design(centred, solver, names)
        requests = design.requests(study.targets.calibrate_at)
        answers = answer_all(requests, solver, folder, executor, watch, study.runs)
        stage |= coding_entry(study, design)
        stage["design"] = design_entry(design, requests, answers, solver)
        stage["design"]["runs"] = weighed(study, stage["design"]["runs"])
        with reasons_given(requests, answers):
            result, reduction, reduced = fit_terms(study, design, stage["design"]["runs"])
        told, described = beside(study, design, result)
        stage |= result.as_dict() | reduction | told
        if study.joint_targets:
            answering = partial(answer_all, solver=solver, folder=folder, executor=executor, watch=watch)
            stage["diameters"] = run_diameters(study, stage, design, solver, partial(answering, policy=study.runs))
        stage["pure_error_note"] = scatter = error_remark(stage)
        stage["published"] = audit_surface(study, stage)
        remarks = [scatter] if scatter and result.lack_of_fit_testable else []
        stage["notes"] = chosen + reduced + stage["notes"] + described + censored_remarks(answers) + remarks
        stage["notes"] += sentences(stage["published"])
        return leave(folder, stage)


def invert(study: Study, folder: StudyFolder, solver: Solver | None = None) -> Stage:
    """Solve the surface for the force measured at the calibration diameter, or several surfaces for theirs."""
    solver = solver or make_solver(study)
    with folder:
        surface = read_fresh(study, solver, folder, "rsm")
        solved = solve_jointly(study, surface) if study.joint_targets else solve(study, surface)
        stage = head(study, solver, folder, "invert") | solved
        stage["published"], remarks = assess_published(study, surface)
        stage["notes"] += remarks
        return leave(folder, stage)


def refine(
    study: Study,
    folder: StudyFolder,
    executor: Executor,
    watch: Watch = ignore,
    solver: Solver | None = None,
) -> Stage:
    """Simulate at the solution and correct it until the simulated force is right, at every diameter of a joint fit."""
    solver = solver or make_solver(study)
    with folder:
        simulate = simulating_at("refine", study, solver, folder, executor, watch)
        surface, solution = (read_fresh(study, solver, folder, stage) for stage in ("rsm", "invert"))
        close = close_jointly if study.joint_targets else close_loop
        return leave(folder, head(study, solver, folder, "refine") | close(study, surface, solution, simulate))


def audit(study: Study, folder: StudyFolder, executor: Executor, watch: Watch = ignore) -> Stage:
    """Recompute a paper's printed tables and claims; list what does not agree."""
    require_printed_runs(study)
    solver = make_solver(study)
    with folder:
        calibrate(study, folder, executor, watch, solver)
        stages = {name: folder.read_stage(name) for name in ("screen", "rsm", "invert", "validate")}
        return leave(folder, head(study, solver, folder, "audit") | audit_all(study, stages))


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
        parameters = read_fresh(study, solver, folder, stage_before(study, "validate") or "invert")["parameters"]
        stage = head(study, solver, folder, "validate") | {"parameters": parameters}
        targets = study.targets.forces
        requests = [Request("validate", row, parameters, target.diameter) for row, target in enumerate(targets)]
        answers = answer_all(requests, solver, folder, executor, watch, study.runs)
        result = compare_diameters(
            [target.diameter for target in targets],
            [target.force for target in targets],
            [answer.force for answer in answers],
            [target.diameter for target in study.joint_targets] or study.targets.calibrate_at,
            [(target.sd, target.n) for target in targets],
            study.targets.equivalent_within_percent,
        )
        stage |= result.as_dict()
        for row, request, answer in zip(stage["rows"], requests, answers, strict=True):
            entry = run_entry(request, answer, solver)
            row |= {name: entry[name] for name in ("status", "censored", "reason", "message", "key")}
            row |= further_responses(study, request.diameter, entry)
        stage["published"] = audit_validation(study)
        stage["notes"] += censored_remarks(answers) + table_remarks(study, solver) + sentences(stage["published"])
        return leave(folder, stage)
