"""What is said of a laboratory's files."""

from __future__ import annotations

import pytest

from stemcal.measured.remarks import (
    ColumnChosen,
    EqualCurves,
    LabRemark,
    LargestAtEnd,
    NotThere,
    OfFiles,
    Outlier,
    RowsLeftOut,
)
from stemcal.text.laboratory import remark_text
from stemcal.text.notes import sentence


@pytest.mark.parametrize("kind", LabRemark.__subclasses__())
def test_every_kind_has_a_sentence(kind: type[LabRemark]) -> None:
    assert sentence.dispatch(kind) is not sentence.dispatch(object)


@pytest.mark.parametrize(
    ("remark", "said"),
    [
        (RowsLeftOut(1), "1 row without numbers for force or displacement is left out"),
        (RowsLeftOut(3), "3 rows without numbers for force or displacement are left out"),
        (
            Outlier(8.0, "8mm-bad", 2.0412, 1.8871, 0.05),
            "grade 8 mm: specimen 8mm-bad is an outlier by Grubbs' test (G = 2.041 > 1.887, alpha 0.05); it is still "
            "included; --exclude leaves it out if the laboratory book gives a reason",
        ),
        (
            ColumnChosen("force", "'a'", ("'b'", "'c'")),
            "force from 'a', not 'b', 'c'; --force-column takes another",
        ),
        (NotThere(("a",)), "the index names a, which is not there"),
        (
            NotThere(tuple(map(str, range(12)))),
            "the index names 0, 1, 2, 3, 4, 5, 6, 7, 8, 9 and 2 more, which are not there",
        ),
        (EqualCurves(("a", "b")), "a and b hold the same curve; leave one out with --exclude"),
        (
            OfFiles(("a", "b"), LargestAtEnd()),
            "a, b: the force is largest at the last point: the test may have ended before the maximum",
        ),
    ],
)
def test_remarks(remark: LabRemark, said: str) -> None:
    assert remark_text(remark) == said
