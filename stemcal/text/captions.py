"""What stands below figures: sentences by what they tell of, joined by spaces."""

from stemcal.text.names import Names

SENTENCES = {
    # screening
    "pareto": "Effects by size, blue raises and orange lowers the {response}. Beyond Lenth's margin of error (ME) or "
    "the limit of the t test an effect is more than chance; beyond the margin SME even as one of so many.",
    "half-normal": "Half-normal plot: effects above the line of chance and beyond Lenth's margins are more than "
    "chance. Symbols are those of the table of effects.",
    # surface
    "observed": "Simulated {response} against the surface's prediction.",
    "residuals": "What the surface leaves unexplained, run by run.",
    "diagnostics": "Residuals against the normal law (on the line: normal) and in order of the runs (no trend: good), "
    "and how strongly each run influences the surface (Cook's distance above 1, dashed: much).",
    "contour": "{capital} over {factors:factors}.",
    "contour at the solution": "{capital} over {factors:factors}, the others at the solution.",
    "contour at the centre": "{capital} over {factors:factors}, the others at the centre.",
    "lines": "The lines have their values.",
    "lines in": "The lines have their values in {unit}.",
    "met": "Orange: where the measured {response} is met; star: the solution.",
    "white dots": "White dots: runs, with their number where there are several.",
    "relief": "Relief of the {response} over {factors:factors}, its lines on the floor.",
    "relief at the solution": "Relief of the {response} over {factors:factors}, the others at the solution; its "
    "lines on the floor.",
    "relief at the centre": "Relief of the {response} over {factors:factors}, the others at the centre; its lines on "
    "the floor.",
    "raised dots": "Dots: runs, full above the surface and open below it.",
    # parameters
    "solutions": "Where the surface meets the target exactly: each factor's range, in coded units; star: the chosen "
    "point; dashed: ±1, dotted: the reach of the design. Its error is left out here.",
    "profiles": "Profile of each factor, the others free. Where the curve is below the dashed line (shaded) lies the "
    "95 % range; vertical line: the calibrated value.",
    "validation": "Measured and simulated {long}.",
    "validation ringed": "Measured and simulated {long}; the ringed {condition} is the calibration's.",
    "validation together": "Measured and simulated {long}; the parameters are fitted to the ringed together.",
    "bars": "Bars: standard deviation of the measurements.",
    "growth": "The same forces on logarithmic axes: the slope is the power of the diameter with which they grow.",
    # another program
    "refinement": "{capital}: measured, and simulated before and after the refinement; the target is ringed.",
    # runs
    "force": "Force over blade travel: validation runs in colour, all others in grey.",
    "dotted": "Dotted: after the stem has broken, not cutting any more.",
    "measured curves": "The curves that were measured and the one simulated at the calibration, each until its "
    "maximum, at shares of its own travel; below, by how many standard deviations of the specimens the forces are "
    "apart.",
    "energies": "Energies over blade travel, stem of {run}.",
    "mesh": "The mesh of the stem of {run}: from the side with blade and supports (grey), and its cross-section.",
    "cut": "The stem of {run} at the end of the simulation, notched by the blade: it ends when the force has dropped "
    "for good, before the stem is cut through. From the side and in section (the bore between the walls), coloured by "
    "plastic strain; elements that failed are gone. Grey: the blade, and the supports with their clearance between.",
    "cut solid": "The stem of {run} at the end of the simulation, notched by the blade: it ends when the force has "
    "dropped for good, before the stem is cut through. From the side and in section, coloured by plastic strain; "
    "elements that failed are gone. Grey: the blade, and the supports with their clearance between.",
    "film": "How the stem of {run} is cut, in section: travel of the blade and force on it above each picture.",
    "fields": "Stress and displacement in the stem of {run} where the force is largest, in section; travel of the "
    "blade and force above. Each has its own scale.",
}


def caption(names: Names, *parts: str, **fields: object) -> str:
    """Return these sentences, as a study calls things.

    >>> caption(Names(), "validation", "bars")
    'Measured and simulated maximum force. Bars: standard deviation of the measurements.'
    """
    response = names.response
    known = {
        "response": response.noun,
        "capital": response.capital,
        "long": response.long,
        "unit": response.written,
        "condition": names.naming.condition_noun,
        **fields,
    }
    return " ".join(names.say(SENTENCES[part], **known) for part in parts)
