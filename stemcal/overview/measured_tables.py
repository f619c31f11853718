"""Tables of what the laboratory brought."""

from stemcal.drawing.columns import to_decimals
from stemcal.drawing.table import Column, Table
from stemcal.formats import fixed, interval, short, signed_probability, significant
from stemcal.measured.diameters import Diameters
from stemcal.measured.shear import ShearTests
from stemcal.overview.measured_tests import MeasuredTests
from stemcal.power_law import PowerLaw
from stemcal.responses import known_response
from stemcal.study.model.laboratory_kind import words_of


def diameter_tables(found: Diameters) -> list[Table]:
    """Return the normal fit of the stem diameters, and their grades."""
    columns = Column("statistic", "Statistic"), Column("value", "Value")
    grades = [
        Column("diameter", "Grade", "mm", short),
        Column("range", "Diameters", "mm", interval, lambda grade: (grade.low, grade.high)),
        Column("count", "Stems", form=format),
        Column("share_percent", "Share", "%", to_decimals(1)),
        Column("fitted_percent", "Fitted", "%", to_decimals(1)),
    ]
    share = f"The grades contain {found.share_percent:.1f} % of the stems. A grade does not include its upper limit."
    return [
        Table(columns, tuple(_statistics(found).items()), "Stem diameters"),
        Table.of(grades, found.grades, "Grades", [share]),
    ]


def shear_tables(tests: ShearTests) -> list[Table]:
    """Return the maximum shear force of every specimen, and the statistics of each grade."""
    diameter = Column("diameter", "Diameter", "mm", short)
    grades = [
        diameter,
        Column("n", "n", form=format),
        Column("mean", "Mean", "N", significant),
        Column("sd", "SD", "N", significant),
        Column("cv_percent", "CV", "%", to_decimals(1)),
        Column("mean_interval", "95 % CI of the mean", "N", interval),
    ]
    specimens = [
        Column("name", "Specimen"),
        diameter,
        Column("maximum", "Maximum", "N", significant, lambda one: one.curve.max_force),
        Column("travel", "Travel", "mm", fixed, lambda one: one.curve.travel_at_max),
        Column("trimmed", "Points trimmed", "", format, lambda one: one.curve.trimmed),
    ]
    return [
        Table.of(grades, tests.grades, "Maximum shear force by grade", _growth(tests.power_law)),
        Table.of(specimens, tests.specimens, "Specimens"),
    ]


def tests_table(tests: MeasuredTests) -> Table:
    """Return the means of what was measured in the tests of a spec."""
    columns = [
        Column("test", "Test"),
        Column("diameter", "Diameter", "mm", short),
        Column("response", "Response", of=lambda mean: words_of(known_response(mean.response))),
        Column("n", "n", form=format, of=lambda mean: mean.summary.n),
        Column("mean", "Mean", "", significant, lambda mean: mean.summary.mean),
        Column("sd", "SD", "", significant, lambda mean: mean.summary.sd),
        Column("unit", "Unit", of=lambda mean: known_response(mean.response).unit),
    ]
    return Table.of(columns, tests.means, "Test measurements")


def _statistics(found: Diameters) -> dict[str, str]:
    """Return the statistics of a sample of stem diameters."""
    summary, test = found.summary, found.normality
    verdict = "not rejected" if test.p >= 0.05 else "rejected"
    return {
        "Stems": f"{summary.n}, {found.readings} readings",
        "Mean, mm": f"{summary.mean:.3f} (95 % CI {interval(summary.mean_interval)})",
        "Standard deviation, mm": f"{summary.sd:.3f} (95 % CI {interval(summary.sd_interval)})",
        "Coefficient of variation, %": fixed(summary.cv_percent, 2),
        "Shapiro–Wilk": f"{test.statistic:.4f}, p {signed_probability(test.p)}, normality {verdict}",
    }


def _growth(law: PowerLaw | None) -> list[str]:
    """Return how the force grows with the diameter."""
    if law is None:
        return []
    ends = "" if law.exponent_interval is None else f" (95 % CI {interval(law.exponent_interval, 3)})"
    formula = f"F = {significant(law.factor, 3)}·d^{law.exponent:.2f}{ends}"
    return [f"{formula} with F in N and d in mm (R² = {law.r2:.3f} for the log–log fit)."]
