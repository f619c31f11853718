"""Rules on what answers in place of the embedded solver: templates, results, the user's own deck, tables."""

from collections.abc import Iterator
from pathlib import Path

from stemcal.naming import CUTTING, DIAMETER, FIRST, FORCE
from stemcal.study import model
from stemcal.study.model.measured_targets import named_modes
from stemcal.study.rules.draft import Draft, Finding
from stemcal.study.types.placeholders import CHANCE, placeholders, template_bytes
from stemcal.study.types.strict_yaml import NodePath
from stemcal.words import did_you_mean

_MOST_UNKNOWN = 20
_RESERVED = {"program-output.txt"}


def placeholders_are_known(draft: Draft) -> Iterator[Finding]:
    """Templates and arguments name factors of the study or the diameter, nothing else."""
    if not isinstance(draft.study.solver, model.CommandSolver | model.SheetSolver):
        return
    condition = draft.naming.condition
    known = (*draft.names, *([] if condition is None else [condition.name]), *CHANCE)
    for index, path in enumerate(draft.study.solver.templates):
        yield from _unknown_in_file(("solver", "templates", index), path, known)
    for index, argument in enumerate(_command(draft)):
        for _, name in placeholders(argument.encode()):
            if name not in known or index == 0:
                message = (
                    f"{{{{{name[:60]}}}}} is not a factor" if index else "the program itself cannot be a placeholder"
                )
                yield Finding(("solver", "command", index), message, did_you_mean(name, known) if index else "name it")


def _command(draft: Draft) -> tuple[str, ...]:
    """Return the arguments of the program; none where people start it."""
    return draft.study.solver.command if isinstance(draft.study.solver, model.CommandSolver) else ()


def _unknown_in_file(node: NodePath, path: Path, known: tuple[str, ...]) -> Iterator[Finding]:
    try:
        content = template_bytes(path)
    except OSError as error:
        yield Finding(node, f"cannot be read: {error.strerror}", "check the file")
        return
    unknown = [(line, name) for line, name in placeholders(content) if name not in known]
    for line, name in unknown[:_MOST_UNKNOWN]:
        yield Finding(node, f"{path.name}:{line}: {{{{{name[:60]}}}}} is not a factor", did_you_mean(name, known))


def placeholders_are_used(draft: Draft) -> Iterator[Finding]:
    """Every factor stands in a template or an argument; one that does not has no effect."""
    solver = draft.study.solver
    if not isinstance(solver, model.CommandSolver):
        return
    try:
        contents = [template_bytes(path) for path in solver.templates]
    except OSError:
        return
    used = {name for text in contents for _, name in placeholders(text)}
    used |= {name for argument in solver.command for _, name in placeholders(argument.encode())}
    for index, factor in draft.factors.items():
        if factor.name not in used:
            message = f"neither a template nor the command holds {{{{{factor.name}}}}}"
            yield Finding(("factors", index, "name"), message, "write it in the place of its value")


def chance_is_said(draft: Draft) -> Iterator[Finding]:
    """A program that takes a seed, or is asked several times over, is not called deterministic."""
    solver = draft.study.solver
    if not isinstance(solver, model.CommandSolver | model.SheetSolver):
        return
    for index, path in enumerate(solver.templates):
        yield from _seed_without_chance(("solver", "templates", index), _content(path), draft)
    for index, argument in enumerate(_command(draft)):
        yield from _seed_without_chance(("solver", "command", index), argument.encode(), draft)


def _seed_without_chance(node: NodePath, content: bytes, draft: Draft) -> Iterator[Finding]:
    if not isinstance(draft.study.solver, model.CommandSolver | model.SheetSolver) or draft.study.solver.by_chance:
        return
    for name in dict.fromkeys(name for _, name in placeholders(content)):
        if name in CHANCE and name not in draft.names:
            message = f"{{{{{name}}}}} is for a stochastic program"
            yield Finding(node, message, "write replicates: 1 under solver")


def _content(path: Path) -> bytes:
    """Return what a template holds; nothing where it cannot be read, which another rule tells."""
    try:
        return template_bytes(path)
    except OSError:
        return b""


def run_files_differ(draft: Draft) -> Iterator[Finding]:
    """The files of a run have different names, also where case does not count; what is read the program has written."""
    if not isinstance(draft.study.solver, model.CommandSolver | model.SheetSolver):
        return
    readers = draft.study.solver.result.values() if isinstance(draft.study.solver, model.CommandSolver) else ()
    seen, read = set(_RESERVED), {reader.file.lower() for reader in readers}
    for key in ("templates", "files"):
        for index, path in enumerate(getattr(draft.study.solver, key, ())):
            if path.name.lower() in read:
                message = f"{path.name} is read as a result; if the program wrote none, this file would be read instead"
                yield Finding(("solver", key, index), message, "remove it, or change the file that the program writes")
            if path.name.lower() in seen:
                message = f"{path.name} is the name of another file in the run folder"
                yield Finding(("solver", key, index), message, "rename one of them")
            seen.add(path.name.lower())


def every_response_is_read(draft: Draft) -> Iterator[Finding]:
    """A program leaves each response; a single reader serves a single one."""
    if not isinstance(draft.study.solver, model.CommandSolver):
        return
    names, path = [response.name for response in draft.naming.responses], ("solver", "result")
    if draft.naming.response == FORCE:
        scores = named_modes(draft.study.targets.modes.values())
        names = [FORCE.name, *(n.name for n in draft.naming.further if n not in (*CUTTING.further, *scores))]
    if not (readers := draft.study.solver.result):
        yield Finding(("solver",), "'result' is missing", "add a line result: …")
    elif FIRST in readers:
        if len(names) > 1:
            remedy = f"write a reader under each name: {names[0]}: {{file: …}}, {names[1]}: {{file: …}}"
            yield Finding(path, f"one reader cannot fill {len(names)} responses", remedy)
        return
    for name in readers:
        if name not in names:
            yield Finding(
                (*path, name), f"{name[:60]!r} is not a response of this study", did_you_mean(name, names), True
            )
    for name in names if readers else ():
        if name not in readers:
            yield Finding(path, f"nothing reads {name}", f"add {name}: {{file: …}}")


def own_names_belong_to_programs(draft: Draft) -> Iterator[Finding]:
    """The embedded solver and the decks answer with the maximum force over the stem's diameter."""
    if draft.naming.is_cutting or not draft.stem_solver or draft.tests or draft.study.targets.modes:
        return
    for section, is_own in (
        ("responses", draft.naming.response != FORCE or draft.naming.further != CUTTING.further),
        ("conditions", draft.naming.condition != DIAMETER),
    ):
        if is_own:
            message = f"the {draft.stem_solver} solver returns only the maximum force of a stem"
            yield Finding((section,), message, "remove it, or use solver: {kind: command}", at_key=True)


def has_abscissa(result: model.ResultReader) -> bool:
    """Whether a reader finds the travel of a curve too."""
    return result.along is not None or "(?P<x>" in (result.pattern or "")


def command_names_deck(draft: Draft) -> Iterator[Finding]:
    """LS-DYNA has a command that names its deck."""
    if not isinstance(draft.study.solver, model.DeckSolver) or draft.study.solver.program != "lsdyna":
        return
    if not draft.study.solver.command:
        yield Finding(("solver",), "LS-DYNA has no command", 'add command: [ls-dyna, "i={{deck}}"]')
        return
    names = [name for argument in draft.study.solver.command[1:] for _, name in placeholders(argument.encode())]
    for name in names:
        if name != "deck":
            yield Finding(("solver", "command"), f"{{{{{name[:60]}}}}} has no meaning here", "write i={{deck}}")
    if "deck" not in names:
        yield Finding(("solver", "command"), "the command does not name the deck", 'add an argument "i={{deck}}"')


def keys_belong_to_the_program(draft: Draft) -> Iterator[Finding]:
    """A deck's solver has no keys of the other program."""
    if not isinstance(draft.study.solver, model.DeckSolver):
        return
    program = draft.study.solver.program
    for key in model.OF_OPENRADIOSS if program == "lsdyna" else model.OF_LSDYNA:
        if key in draft.study.solver.model_fields_set:
            other = "openradioss" if program == "lsdyna" else "lsdyna"
            yield Finding(("solver", key), f"is a key of program: {other} (program is {program})", "remove it")


def openradioss_hardens_isotropically(draft: Draft) -> Iterator[Finding]:
    """The card that OpenRadioss deletes elements by has no hardening parameter."""
    if not isinstance(draft.study.solver, model.DeckSolver) or draft.study.solver.program != "openradioss":
        return
    for index, factor in draft.factors.items():
        if factor.name == "hardening_parameter":
            message = "has no effect: OpenRadioss's deck hardens isotropically"
            yield Finding(("factors", index, "name"), message, "give it a fixed value under material")
