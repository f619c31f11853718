"""What a careful reader must know of a laboratory's files: facts, a class for each kind."""

from stemcal.files.typed import Tagged

Names = tuple[str, ...]


class LabRemark(Tagged):
    """A fact about a file, a curve or a specimen; columns and sheets are as they may be shown."""


class RowsLeftOut(LabRemark):
    """Rows without numbers for force or displacement."""

    rows: int


class RowsApart(LabRemark):
    """Rows of numbers that lie apart from the curve and are not read."""

    rows: int


class SheetSkipped(LabRemark):
    """A sheet without a curve."""

    sheet: str


class FolderSkipped(LabRemark):
    """A folder without a test of its name, or one beside the folder `taken`, of the same name but for its case."""

    folder: str
    taken: str = ""


class SideBySide(LabRemark):
    """Several specimens in the columns of one file."""

    specimens: int


class SharedDisplacement(LabRemark):
    """Several columns of force over one of displacement."""

    specimens: int
    column: str


class ColumnChosen(LabRemark):
    """The column that is taken for ``force`` or ``displacement``, and others that could be."""

    quantity: str
    column: str
    others: Names


class SpeedUnused(LabRemark):
    """A speed was given, but the file has a displacement."""


class DisplacementFromTime(LabRemark):
    """Displacement is time times speed, mm/s."""

    column: str
    speed: float


class PressingIsPositive(LabRemark):
    """The force was negative in pressing and is turned."""


class LargestAtEnd(LabRemark):
    """The force is largest at the last point: the test may have ended before the maximum."""


class OfFiles(LabRemark):
    """A remark on these files, specimens or tests."""

    names: Names
    remark: LabRemark


class NearGrades(LabRemark):
    """Two grades (mm) so near each other that their forces cannot be told apart; they are counted apart."""

    lower: float
    upper: float


class Outlier(LabRemark):
    """A specimen of a grade (mm) beyond the critical value of Grubbs' test; it is still included."""

    grade: float
    specimen: str
    statistic: float
    critical: float
    alpha: float


class Excluded(LabRemark):
    """A specimen that is left out as was asked."""

    specimen: str


class NotThere(LabRemark):
    """The index names what is not there."""

    names: Names


class EqualNames(LabRemark):
    """Files that differ in their ends only: an export beside the workbook, perhaps."""

    names: Names


class EqualCurves(LabRemark):
    """Specimens whose curves are the same to the last digit."""

    names: Names


class PreloadOfWeakStems(LabRemark):
    """The preload (N) is a tenth or more of the mean maximum (N) of a grade (mm)."""

    preload: float
    grade: float
    force: float
