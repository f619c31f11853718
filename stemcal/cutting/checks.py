"""Checks of the result of a run: limits, and the warning for each limit that is exceeded."""

from stemcal.notes import Note, Remedy

# A warning is issued if a share in `CuttingResult` exceeds its limit, percent.
MOST_INERTIA = 5.0
MOST_HOURGLASS = 10.0
MOST_DRIFT = 2.0
MOST_KINETIC = 20.0
# Deviation of a compressed section from a uniform widening, in % of the widening; at most 2 without buckling.
MOST_BUCKLING = 5.0
# Added mass, percent, below which inertia is a property of the real stem and not an error of the model.
NEGLIGIBLE_MASS = 1.0

STROKE_TOO_SHORT = "stroke_too_short"
_LONGER = Remedy("Increase `loading.stroke` or `loading.duration`.")


def stroke_too_short(peak: float, peak_travel: float, end: float, stroke: float) -> Note:
    """Return the warning that the peak force may occur after the end of the stroke; forces in N, travels in mm."""
    text = (
        f"A higher peak may occur after the end of the stroke ({stroke:.3g} mm). The largest recorded force was "
        f"{peak:.1f} N at {peak_travel:.3g} mm; at the end, the force was still {end:.1f} N."
    )
    return Note(STROKE_TOO_SHORT, "warning", text, _LONGER)


def not_severed(stroke: float, percent: float) -> Note:
    """Return the warning that a whole cut ended after a stroke (mm) with a percentage of the cut plane unparted."""
    text = (
        f"The stem was not cut through after a stroke of {stroke:.3g} mm: {percent:.0f} % of the section under "
        "the edge still held. The maximum force and the cutting energy are lower bounds."
    )
    return Note("not_severed", "warning", text, _LONGER)


def bent_away(stroke: float, aside: float, percent: float) -> Note:
    """Return the warning that the blade pushed a clamped stem aside (mm); `percent` of the cut plane is unparted."""
    text = (
        f"The stem was bent away, not cut: after a stroke of {stroke:.3g} mm, the blade has pushed the section under "
        f"the edge {aside:.3g} mm aside, and {percent:.0f} % of the section still holds. Below a critical speed, the "
        "inertia of a clamped stem is too small for a cut."
    )
    remedy = Remedy("Increase `loading.speed`, reduce `supports.height`, or use `supports: {kind: counter_edge}`.")
    return Note("bent_away", "warning", text, remedy)


def broken_elsewhere(travel: float, distance: float) -> Note:
    """Return the warning that the stem broke at a `distance` (mm) from the cut, after a blade `travel` (mm)."""
    text = (
        f"The stem was not cut through: at a travel of {travel:.3g} mm, it broke at a distance of about "
        f"{distance:.3g} mm from the cut. The maximum force and the cutting energy are those of the break."
    )
    return Note("broken_elsewhere", "warning", text, Remedy("Increase `loading.speed`, or support the stem nearby."))


def kinetic_energy(percent: float) -> Note:
    """Return the warning that a large percentage of the blade's work is kinetic energy of the stem at the end."""
    text = (
        f"At the end, {percent:.0f} % of the work of the blade is kinetic energy of the stem. The cutting energy "
        "includes this energy, which depends on the free length of the stem."
    )
    return Note("kinetic_energy", "caution", text)


def maximum_not_passed(stroke: float) -> Note:
    """Return the warning that a laboratory test ended after a stroke (mm), before its maximum force."""
    text = (
        f"The test ended after a stroke of {stroke:.3g} mm, before the maximum force was reached. Force, travel and "
        "work are lower bounds; the slope is not affected."
    )
    return Note("maximum_not_passed", "warning", text, Remedy("Increase the stroke of the test."))


def buckles(percent: float) -> Note:
    """Return the warning that a compressed piece bends or wrinkles; `percent` of its widening is not uniform."""
    text = (
        f"The compressed specimen buckles before it breaks (deviation from a round cross-section: {percent:.0f} % of "
        "the increase in width). Travel, work and maximum force then depend on the mesh; the slope does not."
    )
    remedy = Remedy("Use a shorter specimen. If the wall still buckles, fit only the slope.")
    return Note("buckles", "warning", text, remedy)


def energy_drifts(percent: float) -> Note:
    """Return the warning that the error of the energy balance is a large percentage of the work."""
    text = f"The error in the energy balance is {percent:.1f} % of the work done by the blade."
    return Note("energy_drifts", "warning", text, Remedy("Reduce `solver.time_step_safety` and `solver.time_step`."))


def inertia_in_force(percent: float, kinetic_percent: float) -> Note:
    """Return the warning that inertia is a large share (%) of the force; `kinetic_percent`: kinetic/internal energy."""
    text = (
        f"Inertia contributes {percent:.1f} % of the peak force (blade force minus support force). The kinetic energy "
        f"reaches {kinetic_percent:.1f} % of the internal energy."
    )
    remedy = Remedy("Divide `solver.mass_scaling` by 100 and `solver.time_step` by 10, because both settings add mass.")
    return Note("inertia_in_force", "warning", text, remedy)


def hourglass_energy(percent: float) -> Note:
    """Return the warning that hourglass energy is a large percentage of internal energy."""
    text = f"The hourglass energy is {percent:.1f} % of the internal energy."
    return Note("hourglass_energy", "warning", text, Remedy("Use smaller elements (`solver.element_size`)."))


def rate_above_law(rate: float, c: float, factor: float) -> Note:
    """Return the warning that a strain rate (1/s) exceeds C of the law 1 + (rate/C)^P, which has the value `factor`."""
    text = (
        f"The strain rate reaches {rate:.3g}/s before the peak force and exceeds C = {c:.3g}/s. There, "
        f"`rate_law: paper` multiplies the yield stress by {factor:.2g}, and the force depends on the mesh."
    )
    remedy = Remedy("Use `rate_law: cowper_symonds` under `solver`.", "solver: {rate_law: cowper_symonds}")
    return Note("rate_above_law", "warning", text, remedy)


def force_after_break(travel: float, force: float, peak: float) -> Note:
    """Return the warning that the force exceeds its peak after the first fracture; travel in mm, forces in N."""
    text = (
        f"After the first fracture at a travel of {travel:.3g} mm, the released stem strikes the blade. The contact "
        f"force ({force:.1f} N) then exceeds the peak force ({peak:.1f} N). The force after the first fracture is not "
        "a cutting force."
    )
    return Note("force_after_break", "warning", text)


def nothing_deleted() -> Note:
    """Return the warning that elements remain in the mesh after failure, because the material deletes none."""
    text = (
        "The material law does not delete failed elements: they lose their shear strength at the failure strain but "
        "remain in the mesh."
    )
    return Note("nothing_deleted", "warning", text)
