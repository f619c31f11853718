"""Fields of the cards that an import reads, which of them it uses, and which it may pass over."""

from collections.abc import Iterator

from stemcal.solvers.deck_import.keyword_blocks import Block

_EPS = tuple(f"eps{i}" for i in range(1, 9))
_ES = tuple(f"es{i}" for i in range(1, 9))
_CONTACT = (
    ("ssid", "msid", "sstyp", "mstyp", "sboxid", "mboxid", "spr", "mpr"),
    ("fs", "fd", "dc", "vc", "vdc", "penchk", "bt", "dt"),
    ("sfs", "sfm", "sst", "mst", "sfst", "sfmt", "fsf", "vsf"),
    ("isym", "erosop", "iadj"),
)
CARDS: dict[str, tuple[tuple[str, ...], ...]] = {
    "CONTROL_TERMINATION": (("endtim", "endcyc", "dtmin", "endeng", "endmas"),),
    "CONTROL_TIMESTEP": (("dtinit", "tssfac", "isdo", "tslimt", "dt2ms", "lctm", "erode", "ms1st"),),
    "CONTROL_HOURGLASS": (("ihq", "qh"),),
    "CONTROL_CONTACT": (("slsfac", "rwpnal", "islchk", "shlthk", "penopt", "thkchg", "orien", "enmass"),),
    "CONTROL_ENERGY": (("hgen", "rwen", "slnten", "rylen"),),
    "DATABASE_RCFORC": (("dt", "binary"),),
    "DATABASE_GLSTAT": (("dt", "binary"),),
    "DATABASE_BINARY_D3PLOT": (("dt",),),
    "MAT_PLASTIC_KINEMATIC": (("mid", "ro", "e", "pr", "sigy", "etan", "beta"), ("src", "srp", "fs", "vp")),
    "MAT_PIECEWISE_LINEAR_PLASTICITY": (
        ("mid", "ro", "e", "pr", "sigy", "etan", "fail", "tdel"),
        ("c", "p", "lcss", "lcsr", "vp"),
        _EPS,
        _ES,
    ),
    "MAT_RIGID": (
        ("mid", "ro", "e", "pr", "n", "couple", "m", "alias"),
        ("cmo", "con1", "con2"),
        ("lco", "a2", "a3", "v1", "v2", "v3"),
    ),
    "SECTION_SOLID": (("secid", "elform", "aet"),),
    "PART": (("pid", "secid", "mid", "eosid", "hgid", "grav", "adpopt", "tmid"),),
    "BOUNDARY_PRESCRIBED_MOTION_RIGID": (("pid", "dof", "vad", "lcid", "sf", "vid", "death", "birth"),),
    "DEFINE_CURVE": (("lcid", "sidr", "sfa", "sfo", "offa", "offo", "dattyp"),),
    "CONTACT_ERODING_SURFACE_TO_SURFACE": _CONTACT,
    "CONTACT_AUTOMATIC_SURFACE_TO_SURFACE": _CONTACT[:3],
    "CONTACT_SURFACE_TO_SURFACE": _CONTACT[:3],
}
_OTHER_NAMES = {
    "MAT_003": "MAT_PLASTIC_KINEMATIC",
    "MAT_024": "MAT_PIECEWISE_LINEAR_PLASTICITY",
    "MAT_020": "MAT_RIGID",
}
# What an import uses, or what changes nothing in its model whatever it says.
_USED = {
    *("endtim", "tssfac", "dt2ms", "ihq", "qh", "slsfac", "mid", "ro", "e", "pr", "sigy", "etan", "beta", "src", "srp"),
    *(
        "fs",
        "fail",
        "c",
        "p",
        "cmo",
        "con1",
        "con2",
        "secid",
        "elform",
        "pid",
        "dof",
        "vad",
        "lcid",
        "sf",
        "sfa",
        "sfo",
    ),
    *("ssid", "msid", "sstyp", "mstyp", "fd", "dc", "vdc", "sfs", "sfm", "spr", "mpr", "binary"),
    *("hgen", "rwen", "slnten", "rylen", "isym", "erosop", "iadj", "islchk", "penopt", "orien", "shlthk", "enmass"),
}
# Values that say nothing, beside 0.
_EMPTY = {"dt": 1e20, "sfst": 1.0, "sfmt": 1.0, "fsf": 1.0, "vsf": 1.0, "death": 1e28}


def known_name(name: str) -> str:
    """Return the name that `CARDS` has for a keyword, or the name itself.

    >>> known_name("MAT_024"), known_name("LOAD_BODY_Z")
    ('MAT_PIECEWISE_LINEAR_PLASTICITY', 'LOAD_BODY_Z')
    """
    return _OTHER_NAMES.get(name, name)


def passed_over(block: Block) -> Iterator[str]:
    """Yield what a keyword says that an import has no use for."""
    cards = CARDS[known_name(block.name)]
    kept = block.name.startswith("DATABASE")
    for index, names in enumerate(cards):
        for name, value in block.fields(index, names).items():
            says_something = value != 0.0 and value != _EMPTY.get(name)
            if says_something and name not in _USED and not kept:
                yield f"*{block.name} at line {block.line}: {name} = {value:g}"
    tables = block.name == "DEFINE_CURVE"
    if len(block.cards) > len(cards) and not tables:
        yield f"*{block.name} at line {block.line}: card {len(cards) + 1} and after"
