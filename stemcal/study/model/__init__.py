"""The study as data: frozen models, every value in internal units (mm, tonne, s, N, MPa, degrees).

A key of a spec is a field, and what it means stands below it: the JSON schema, the reference page, the spec that
`stemcal init` writes, `check` and `explain` all take it from there.
"""

from stemcal.study.model.design_options import (
    RsmOptions,
    ScreenOptions,
    factors_taken,
    strongest_asked,
)
from stemcal.study.model.factor import MOST_FACTORS, Factor, OwnQuantity
from stemcal.study.model.growth import MOST_EXPONENT, Grades, Growth, exponents_in
from stemcal.study.model.laboratory_tests import LaboratoryMeans, LaboratorySection
from stemcal.study.model.measured_targets import Mean, Target, TargetRow, Targets
from stemcal.study.model.parameters import AROUND, EMBEDDED, PARAMETERS, Parameter
from stemcal.study.model.program_options import (
    OF_LSDYNA,
    OF_OPENRADIOSS,
    CommandSolver,
    DeckSolver,
    ProgramOptions,
    program_of,
)
from stemcal.study.model.refine_options import Elsewhere, RefineOptions
from stemcal.study.model.result_readers import ResultReader
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
from stemcal.study.model.sheet_options import SheetSolver
from stemcal.study.model.solver_options import BREAK_DROP, EmbeddedSolver
from stemcal.study.model.stage_options import ClimbOptions, InvertOptions, RunsOptions, ValidateOptions
from stemcal.study.model.whole_study import AnySolver, Study, StudyForm

# fmt: off
__all__ = [
    "AROUND",
    "BREAK_DROP",
    "DAMPING",
    "EMBEDDED",
    "GAP",
    "MOST_EXPONENT",
    "MOST_FACTORS",
    "OF_LSDYNA",
    "OF_OPENRADIOSS",
    "PARAMETERS",
    "AnySolver",
    "BladeSection",
    "ClimbOptions",
    "CommandSolver",
    "ContactSection",
    "DeckSolver",
    "Elsewhere",
    "EmbeddedSolver",
    "Factor",
    "Grades",
    "Growth",
    "InvertOptions",
    "LaboratoryMeans",
    "LaboratorySection",
    "LoadingSection",
    "MachineSection",
    "MaterialSection",
    "Mean",
    "OwnQuantity",
    "Parameter",
    "ProgramOptions",
    "RefineOptions",
    "ResultReader",
    "RsmOptions",
    "RunsOptions",
    "ScreenOptions",
    "SheetSolver",
    "SpecimenSection",
    "Study",
    "StudyForm",
    "SupportsSection",
    "Target",
    "TargetRow",
    "Targets",
    "ValidateOptions",
    "exponents_in",
    "factors_taken",
    "program_of",
    "strongest_asked",
]
# fmt: on
