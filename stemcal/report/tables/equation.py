"""Terms of a response surface, and how they are written."""

from collections.abc import Mapping, Sequence

from stemcal.doe.regression.fit_statistics import Coefficient
from stemcal.naming import FORCE, Named
from stemcal.report.tables.columns import response_decimals
from stemcal.text.numbers import fixed

ONE = "1"


def written(term: str, symbols: Mapping[str, str]) -> str:
    """Return a term as it stands in an equation.

    >>> written("yield_stress:failure_strain", {"yield_stress": "X4", "failure_strain": "X9"})
    'X4·X9'
    """
    if term.endswith("^2"):
        name = term.removesuffix("^2")
        return f"{symbols.get(name, name)}²"
    return "·".join(symbols.get(name, name) for name in term.split(":"))


def equation(coefficients: Sequence[Coefficient], symbols: Mapping[str, str], response: Named = FORCE) -> str:
    """Return the surface of a response as an equation in coded units.

    >>> from types import SimpleNamespace as C
    >>> equation([C(term="1", value=120.415), C(term="a^2", value=-0.829)], {"a": "X9"})
    'F = 120.42 − 0.83·X9²'
    """
    text, places = "", response_decimals(response, [row.value for row in coefficients if row.term != ONE])
    for row in coefficients:
        size = fixed(abs(row.value), places) + ("" if row.term == ONE else f"·{written(row.term, symbols)}")
        sign = "−" if row.value < 0.0 else "+"
        text += f" {sign} {size}" if text else f"{'−' if row.value < 0.0 else ''}{size}"
    return f"{response.symbol} = {text}"
