"""What is said of a paper's printed numbers beside the computed ones."""

from collections.abc import Iterator

from stemcal.notes import Weight
from stemcal.numbers import minus
from stemcal.stages.printed_numbers import Disagreement, decimals_of
from stemcal.stages.printed_tables import Audited, Difference
from stemcal.text.language import say
from stemcal.text.names import Names
from stemcal.text.notes import Remark, sentence

_MOST = 5


def remarks(published: Audited | None, names: Names) -> Iterator[Remark]:
    """Yield the printed cells that disagree, the first few in full."""
    differences = () if published is None else published.differences
    for difference in differences[:_MOST]:
        text = sentence(difference, names)
        yield Remark(text, Weight.TRUST, text)
    if len(differences) > _MOST:
        more = say("{more} more printed numbers differ.", more=len(differences) - _MOST)
        yield Remark(more, Weight.TRUST, "more_differences")


@sentence.register
def _(difference: Difference, names: Names) -> str:
    cell = difference.cell
    if cell.nature == "unreadable":
        template = "{cell}: the paper prints {printed}, which is not a number."
    elif cell.value is None:
        template = "{cell}: the paper prints {printed}, its data give no such number."
    elif cell.nature == "sign":
        template = "{cell}: the paper prints {printed}, its data give {computed}: the sign differs."
    else:
        template = "{cell}: the paper prints {printed}, its data give {computed}."
    printed = repr(cell.printed) if cell.nature == "unreadable" else minus(cell.printed)
    return names.say(template, cell=_cell(difference, names), printed=printed, computed=_computed(cell))


def _cell(difference: Difference, names: Names) -> str:
    """Name a cell by its term and, where there are several, its column."""
    cell = difference.cell
    if difference.table == "validation":
        return names.say("error at {condition:condition}", condition=float(cell.term))
    if difference.table == "claims":
        return cell.term.replace("_", " ")
    return names.say("{term:factor} {column}", term=cell.term, column=cell.column).strip()


def _computed(cell: Disagreement) -> str:
    """Write the computed value with one digit more than was printed, with its sign where that differs."""
    if cell.value is None or cell.nature == "unreadable":
        return ""
    decimals = max(decimals_of(cell.printed) + 1, 0)
    tiny = cell.value != 0.0 and abs(cell.value) < 0.5 * 10.0**-decimals
    sign = "+" if cell.nature == "sign" else ""
    return minus(f"{cell.value:{sign}.2g}" if tiny else f"{cell.value:{sign}.{decimals}f}")
