"""A table is data: columns know how their values are written, rows keep the values."""

from stemcal.drawing.table import Column, Table

LENGTH = Column("length", "Length", "mm", "{:.1f}".format)
TABLE = Table.of(
    ["name", LENGTH, Column("range", "95 %", claims=True)],
    [{"name": "a", "length": 2.25, "range": "2 to 3"}, {"name": "b", "length": "failed"}],
    "Lengths",
    ["A foot."],
    claimed=("A claim.",),
)


def test_paper_has_labels_and_texts_files_have_keys_and_values() -> None:
    assert TABLE.heads == ("name", "Length, mm", "95 %")
    assert TABLE.cells == (("a", "2.2", "2 to 3"), ("b", "failed", ""))
    assert TABLE.csv() == "name,length,range\na,2.25,2 to 3\nb,failed,\n"
    assert TABLE.to_frame()["length"].tolist() == [2.25, "failed"]
    assert [column.left for column in TABLE.columns] == [True, False, True]


def test_what_claims_goes_where_a_study_is_not_calibrated() -> None:
    left = TABLE.unclaimed()
    assert left is not None and left.heads == ("name", "Length, mm")
    assert left.foot == ("A foot.",) and left.claimed == () and left.rows[0] == ("a", 2.25)
    assert Table.of(["a"], [{"a": 1}], claims=True).unclaimed() is None
