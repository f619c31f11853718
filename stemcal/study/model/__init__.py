"""The study as data: frozen models, every value in internal units (mm, tonne, s, N, MPa, degrees).

A key of a spec is a field, and its meaning is the docstring below it: the JSON schema, the reference page, the spec
that `stemcal init` writes, `check` and `explain` all take it from there.
"""

from stemcal.study.model.growth import MOST_EXPONENT, Grades, Growth, exponents_in
from stemcal.study.model.laboratory_kind import TESTS, LaboratoryKind, LaboratoryMeans, LaboratorySection, PieceSection
from stemcal.study.model.measured_targets import Mean, Target, TargetRow, Targets
from stemcal.study.model.shear_test import (
    DAMPING,
    GAP,
    BladeSection,
    ContactSection,
    LoadingSection,
    MachineSection,
    MaterialSection,
    SpecimenSection,
    SupportsSection,
)
from stemcal.study.model.whole_study import RunsOptions, Study, StudyForm
from stemcal.study.types.factor import AROUND, EMBEDDED, MOST_FACTORS, PARAMETERS, Factor, OwnQuantity, Parameter
from stemcal.study.types.solver_kind import SOLVERS, AnySolver, Mesh, SolverKind, SolverOptions, kind_of

# fmt: off
__all__ = [
    "AROUND",
    "DAMPING",
    "EMBEDDED",
    "GAP",
    "MOST_EXPONENT",
    "MOST_FACTORS",
    "PARAMETERS",
    "SOLVERS",
    "TESTS",
    "AnySolver",
    "BladeSection",
    "ContactSection",
    "Factor",
    "Grades",
    "Growth",
    "LaboratoryKind",
    "LaboratoryMeans",
    "LaboratorySection",
    "LoadingSection",
    "MachineSection",
    "MaterialSection",
    "Mean",
    "Mesh",
    "OwnQuantity",
    "Parameter",
    "PieceSection",
    "RunsOptions",
    "SolverKind",
    "SolverOptions",
    "SpecimenSection",
    "Study",
    "StudyForm",
    "SupportsSection",
    "Target",
    "TargetRow",
    "Targets",
    "exponents_in",
    "kind_of",
]
# fmt: on
