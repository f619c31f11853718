"""Rules that check the `solver` section of a spec for each kind of solver. Each rule yields its violations."""

from collections.abc import Iterator
from math import cos, radians
from pathlib import Path
from typing import Protocol

from stemcal.formats import did_you_mean
from stemcal.solvers.options import CommandSolver, DeckSolver, EmbeddedSolver
from stemcal.study.model.measured_targets import named_modes
from stemcal.study.rules import Draft
from stemcal.study.rules.factors import extremes_of
from stemcal.study.types.field_types import field_or_none
from stemcal.study.types.named import CHANCE, placeholders, template_bytes
from stemcal.study.types.strict_yaml import Finding, NodePath
from stemcal.vocabulary import FIRST, FORCE

_MOST_UNKNOWN = 20
_RESERVED = {"program-output.txt"}
# Largest number of elements across the diameter. With more, the stem would have over 10⁹ elements.
_MOST_ACROSS = 1000.0
# Smallest stroke for a complete cut, in stem diameters. Stems between two supports are cut through at 0.35 to 0.65.
_LEAST_CUT = 1.0 / 3.0


def _elements_fit_stem(draft: Draft, solver: EmbeddedSolver) -> Iterator[Finding]:
    if not draft.diameters:
        return
    thinnest, thickest = min(draft.diameters.values()), max(draft.diameters.values())
    if solver.element_size.at(thinnest) > thinnest / 2:
        message = f"an element size of {solver.element_size} is too large for a stem diameter of {thinnest:g} mm"
        yield Finding(("solver", "element_size"), message, f"use about {thinnest / 8:.2g} mm")
    if (across := thickest / solver.element_size.at(thickest)) > _MOST_ACROSS:
        message = f"an element size of {solver.element_size} is too small for a stem diameter of {thickest:g} mm"
        yield Finding(("solver", "element_size"), f"{message} ({across:.3g} elements)", "write d/16, or check the unit")


class _Templated(Protocol):
    """Options of a solver with template files."""

    @property
    def templates(self) -> tuple[Path, ...]: ...

    @property
    def repeats(self) -> int: ...


def _texts(solver: _Templated) -> Iterator[tuple[NodePath, str, bytes | OSError]]:
    """Yield texts that may have placeholders: place in the spec, file name ("" for an argument), content or error."""
    for index, path in enumerate(solver.templates):
        try:
            yield ("solver", "templates", index), path.name, template_bytes(path)
        except OSError as error:
            yield ("solver", "templates", index), path.name, error
    for index, argument in enumerate(solver.command if isinstance(solver, CommandSolver) else ()):
        yield ("solver", "command", index), "", argument.encode()


def _placeholders_are_known(draft: Draft, solver: _Templated) -> Iterator[Finding]:
    condition = draft.naming.condition
    known = (*draft.names, *([] if condition is None else [condition.name]), *CHANCE)
    for node, file, content in _texts(solver):
        if isinstance(content, OSError):
            yield Finding(node, f"the template cannot be read: {content.strerror}", "check the file")
        elif node == ("solver", "command", 0) and any(placeholders(content)):
            yield Finding(node, "the program name cannot be a placeholder", "write the name of the program")
        else:
            unknown = [(line, name) for line, name in placeholders(content) if name not in known]
            for line, name in unknown[:_MOST_UNKNOWN]:
                place = f"{file}:{line}: " if file else ""
                yield Finding(node, f"{place}{{{{{name[:60]}}}}} is not a factor", did_you_mean(name, known))


def _placeholders_are_used(draft: Draft, solver: CommandSolver) -> Iterator[Finding]:
    contents = [content for _, _, content in _texts(solver)]
    used = {name for text in contents if not isinstance(text, OSError) for _, name in placeholders(text)}
    if any(isinstance(content, OSError) for content in contents):
        return
    for index, factor in draft.factors.items():
        if factor.name not in used:
            message = f"neither a template nor the command contains {{{{{factor.name}}}}}"
            yield Finding(("factors", index, "name"), message, "write this placeholder in a template or in the command")


def _chance_is_declared(draft: Draft, solver: _Templated) -> Iterator[Finding]:
    for node, _, content in () if solver.repeats else _texts(solver):
        names = [] if isinstance(content, OSError) else [name for _, name in placeholders(content)]
        for name in dict.fromkeys(names):
            if name in CHANCE and name not in draft.names:
                message = f"{{{{{name}}}}} is allowed only for a stochastic program"
                yield Finding(node, message, "write `replicates: 1` under `solver`")


def _run_files_differ(_draft: Draft, solver: _Templated) -> Iterator[Finding]:
    readers = solver.result.values() if isinstance(solver, CommandSolver) else ()
    seen, read = set(_RESERVED), {reader.file.lower() for reader in readers}
    for key in ("templates", "files"):
        for index, path in enumerate(field_or_none(solver, key) or ()):
            if path.name.lower() in read:
                message = f"the result file has the same name; {path.name} would be read if the program wrote no result"
                yield Finding(("solver", key, index), message, "remove this file, or rename the result file")
            if path.name.lower() in seen:
                message = f"another file in the run folder has the name {path.name}"
                yield Finding(("solver", key, index), message, "rename one of the files")
            seen.add(path.name.lower())


def _every_response_is_read(draft: Draft, solver: CommandSolver) -> Iterator[Finding]:
    names, path = [response.name for response in draft.naming.responses], ("solver", "result")
    if draft.naming.response == FORCE:
        scores = named_modes(draft.study.targets.modes.values())
        names = [FORCE.name, *(n.name for n in draft.naming.others if n not in scores)]
    if not (readers := solver.result):
        yield Finding(("solver",), "'result' is missing", "add a line `result: …`")
    elif FIRST in readers:
        if len(names) > 1:
            examples = " and ".join(f"`{name}: {{file: …}}`" for name in names[:2])
            remedy = f"write one reader for each response, such as {examples}"
            yield Finding(path, f"one reader cannot return {len(names)} responses", remedy)
        return
    for name in readers:
        if name not in names:
            message = f"{name[:60]!r} is not a response of this study"
            yield Finding((*path, name), message, did_you_mean(name, names), True)
    for name in names if readers else ():
        if name not in readers:
            yield Finding(path, f"no reader returns {name}", f"add {name}: {{file: …}}")


def _command_names_deck(_draft: Draft, solver: DeckSolver) -> Iterator[Finding]:
    if solver.program != "lsdyna":
        return
    if not solver.command:
        yield Finding(("solver",), "no command is specified for LS-DYNA", 'add `command: [ls-dyna, "i={{deck}}"]`')
        return
    names = [name for argument in solver.command[1:] for _, name in placeholders(argument.encode())]
    for name in names:
        if name != "deck":
            yield Finding(("solver", "command"), f"unknown placeholder {{{{{name[:60]}}}}}", "write i={{deck}}")
    if "deck" not in names:
        message = "the command does not contain the placeholder {{deck}}"
        yield Finding(("solver", "command"), message, 'add an argument "i={{deck}}"')


def _keys_are_of_the_program(_draft: Draft, solver: DeckSolver) -> Iterator[Finding]:
    key, other = ("home", "openradioss") if solver.program == "lsdyna" else ("command", "lsdyna")
    if key in solver.model_fields_set:
        yield Finding(("solver", key), f"this key applies only to `program: {other}`", "remove this key")


def _openradioss_hardens_isotropically(draft: Draft, solver: DeckSolver) -> Iterator[Finding]:
    for index, factor in draft.factors.items():
        if factor.name == "hardening_parameter" and solver.program == "openradioss":
            message = "the parameter has no effect because the OpenRadioss deck uses isotropic hardening"
            remedy = "set the parameter to a fixed value in the `material` section"
            yield Finding(("factors", index, "name"), message, remedy)


def _whole_cut_can_part(draft: Draft, solver: EmbeddedSolver) -> Iterator[Finding]:
    study = draft.study
    if study.supports.kind != "span" and solver.edge_over == "elements":
        message = f"`supports.kind: {study.supports.kind}` requires a row of nodes under the edge"
        yield Finding(("solver", "edge_over"), message, "write `edge_over: nodes`")
    if study.loading.until != "severed":
        return
    if study.supports.kind == "span" and solver.edge_over == "elements":
        message = "`until: severed` requires a row of nodes under the edge, where the stem parts"
        yield Finding(("solver", "edge_over"), message, "write `edge_over: nodes`")
    if study.blade.bevel == "one" and solver.replicates is None:
        message = "the force of a whole cut with one bevel varies by up to 12 % with the position of the mesh"
        yield Finding(("blade", "bevel"), message, "write `replicates: 4` under `solver`, or `bevel: both`")
    for path, length in study.lengths.items():
        if length.at(1.0) == 0.0:
            yield Finding(path, f"`until: severed` requires `{path[1]}`", f"remove `{path[1]}: 0 mm`")
    written = study.loading.model_fields_set & {"stroke", "duration"}
    if not written or ("speed" in draft.names and "stroke" not in written):
        return  # the default is long enough; another rule reports a stroke that depends on the factor `speed`
    thickest = max(draft.diameters.values(), default=0.0)
    sliding = max(extremes_of(study, draft.factors.values(), "sliding_angle"))
    stroke = study.loading.stroke_at(thickest) * cos(radians(sliding))
    if stroke < _LEAST_CUT * thickest:
        ((key, value),) = study.loading.written.items()
        across = f" at a sliding angle of {sliding:g} deg" if sliding else ""
        message = f"{stroke:.3g} mm of travel across the stem ({value}{across}) cannot cut through {thickest:g} mm"
        yield Finding(("loading", key), message, f"remove `{key}`; the stroke then is 1.5 times the diameter")


OF_EMBEDDED = (_elements_fit_stem, _whole_cut_can_part)
OF_TEMPLATES = (_placeholders_are_known, _chance_is_declared, _run_files_differ)
OF_COMMAND = (*OF_TEMPLATES, _placeholders_are_used, _every_response_is_read)


def _deck_ends_at_the_first_fracture(draft: Draft, _solver: DeckSolver) -> Iterator[Finding]:
    if draft.study.loading.until == "severed":
        remedy = "write `until: first_fracture`, or use `solver: {kind: embedded}`"
        yield Finding(("loading", "until"), "`until: severed` is not available in a deck", remedy)


_OF_PROGRAM = (_command_names_deck, _keys_are_of_the_program, _openradioss_hardens_isotropically)
OF_DECK = (_deck_ends_at_the_first_fracture, *_OF_PROGRAM)
