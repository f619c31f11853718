"""Ranges to begin with for the stems of some crops, each with where it was published.

A modulus is that of bending. A yield stress reaches from the smallest to the largest of the strength in bending (or
tension) and √3 times the strength in shear, which is what von Mises' law makes of it. Stems differ by variety, height
and moisture more than these ranges tell: they are where a search begins, not what it must find.
"""

from typing import NamedTuple


class Range(NamedTuple):
    """Lower and upper end in MPa, and what was measured by whom."""

    low: float
    high: float
    source: str


class Crop(NamedTuple):
    """What is published of a crop's stems; None where no range was found."""

    plant: str
    elastic_modulus: Range
    yield_stress: Range | None
    remark: str = ""


_CHANDIO = "F. A. Chandio et al., African Journal of Biotechnology 12 (2013) 1068, doi 10.5897/AJB12.2342"
_CHANDIO_BENDING = "F. A. Chandio et al., Bulgarian Journal of Agricultural Science (no volume on its abstract, no DOI)"
_ODOGHERTY = "M. J. O'Dogherty et al., Journal of Agricultural Engineering Research 62 (2), 1995, 133-142"
_HOSEINZADEH = "B. Hoseinzadeh, A. Shirneshan, American-Eurasian J. Agric. & Environ. Sci. 12 (3), 2012, 275-281"
_SEFLEK = "A. Y. Seflek, The Journal of Animal & Plant Sciences 27 (3), 2017, 855-860"
_BASTIAN = "J. Bastian, B. Shridar, Indian Journal of Applied Research (ISSN 2249-555X) 4 (9), 2014"
_TAGHIJARAH = "H. Taghijarah et al., Australian Journal of Crop Science 5 (6), 2011, 630-634"
_SHAHBAZI = "F. Shahbazi, Agricultural Engineering International: CIGR Journal, article 4573"

CROPS: dict[str, Crop] = {
    "wheat": Crop(
        "wheat straw (Triticum aestivum), 8 to 22 % moisture",
        Range(4760, 6580, f"4.76 to 6.58 GPa: {_ODOGHERTY}"),
        Range(8.5, 31.2, f"shear 4.91 to 7.26, tension 21.2 to 31.2 MPa: {_ODOGHERTY}"),
    ),
    "rice": Crop(
        "rice straw (Oryza sativa), 18 % moisture",
        Range(200, 720, f"0.20 to 0.72 GPa: {_CHANDIO_BENDING}"),
        Range(7.2, 24.8, f"bending 7.17 to 15.99 MPa: {_CHANDIO_BENDING}; shear 6.06 to 14.33 MPa: {_CHANDIO}"),
    ),
    "rape": Crop(
        "stems of rape, canola (Brassica napus), 35 to 57 % moisture",
        Range(1570, 2040, f"1.57 to 2.04 GPa, means of three varieties: {_HOSEINZADEH}"),
        Range(1.6, 48.1, f"shear 0.92 to 1.32, bending 44.8 to 48.1 MPa, means of varieties: {_HOSEINZADEH}"),
    ),
    "sugarcane": Crop(
        "stalks of sugarcane (Saccharum officinarum), fresh",
        Range(86, 1172, f"86 MPa, and 1172 MPa quoted from Qingting et al. (2006): {_BASTIAN}"),
        Range(5.2, 46, f"shear 3.03 to 4.43 MPa: {_TAGHIJARAH}; bending 46 MPa (Qingting et al. 2006): {_BASTIAN}"),
    ),
    "chickpea": Crop(
        "stems of chickpea (Cicer arietinum), 10 to 25 % moisture",
        Range(303, 695, f"302.5 to 694.8 MPa: {_SHAHBAZI}"),
        Range(17.1, 39.2, f"bending 17.07 to 39.20 MPa: {_SHAHBAZI}"),
    ),
    "maize": Crop(
        "stalks of maize (Zea mays), 70 to 78 % moisture",
        Range(10, 674, f"10.04 to 673.8 MPa, ten cultivars: {_SEFLEK}"),
        None,
        f"The largest strength in shear was 5.27 MPa, which makes a yield stress of 9.1 MPa: {_SEFLEK}",
    ),
}
