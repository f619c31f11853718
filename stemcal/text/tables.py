"""What stands above and below tables: titles, feet, and words in place of numbers."""

from stemcal.naming import CUTTING, Naming
from stemcal.text.names import Names

LINES = {
    # screening and surface
    "effects": "Effects on the {response}",
    "stars": "** p < 0.01, * p < 0.05. Share: of the total sum of squares.",
    "lenth": "Lenth: pseudo standard error {pse:response}; an effect beyond ±{me:response} is significant, beyond "
    "±{sme:response} also as one of all factors.",
    "by F": "The F test chooses the factors: its residual has at least 3 degrees of freedom.",
    "by Lenth": "Lenth's method chooses the factors: the residual has fewer than 3 degrees of freedom or is zero.",
    "anova": "Analysis of variance",
    "untestable": "Lack of fit cannot be tested.",
    "coefficients": "Response surface in coded units",
    "fit": "Quality of the fit",
    "canonical": "Canonical analysis",
    "no stationary point": "No single stationary point: the surface is a plane, or level along some direction.",
    "inside": "Stationary point: {kind}, {value:response .4g} at {levels}; coded radius {radius:.2f}, inside the "
    "region of the runs.",
    "outside": "Stationary point: {kind}, {value:response .4g} at {levels}; coded radius {radius:.2f}, outside the "
    "region of the runs.",
    "curvature": "Negative: the {response} falls on both sides along that axis; the columns give its direction, coded.",
    "of another": "{title}: {response}",
    "of another at": "{title}: {response} at {at:condition}",
    # parameters
    "calibration": "Calibrated parameters",
    "point": "Target {target:response .6g}; predicted {predicted:response .4g}; coded radius {radius:.3f}; rule "
    "{rule}.",
    "point of all": "Target {target:response .6g}; predicted {predicted:response .4g}; coded radius {radius:.3f}; "
    "least squares over all that is fitted together.",
    "intervals of the response": "95 % interval of the mean {response} {mean:responses}, of one simulated {response} "
    "{one:responses}.",
    "joint": "Fitted together",
    "joint errors": "Largest error {error:fixed} %, left out {left_out:fixed} %.",
    "fitted errors": "Largest error {error:fixed} %.",
    "left out": "Left out: predicted from a fit to the others.",
    "test left out": "Left out: predicted from a fit to the other tests. Others allow: where these put the mean, with "
    "95 %.",
    "known": "How well the measurements fix the parameters",
    "profile": "95 % intervals by profile likelihood; free: half of the range or more remains possible.",
    "climb": "Steps towards the target",
    "target": "Target {target:response .6g}.",
    "target at": "Target {target:response .6g} at {at:condition}.",
    "centre": "The design of the surface: {levels} (coded 0 ± 1).",
    # refinement
    "refinement": "Measured and simulated, {there}",
    "own model": "the study's own model",
    "within": "The best point is within {tolerance:g} %, after {runs} of {budget} runs.",
    "beyond": "The best point is not within {tolerance:g} %, after {runs} of {budget} runs.",
    "aim of own": "After a joint fit the target is what the study's own model gives: {aim:response .4g}.",
    "error after": "Error = 100·(measured − after)/measured.",
    "refinement runs": "Runs of the refinement",
    "predicted then": "Predicted: before the run. Interval: whether the simulated {response} is inside its 95 % "
    "prediction interval.",
    "refined there": "Parameters for {there}",
    "alone": "Other parameters keep their calibrated values. The search ends at the first values within its tolerance; "
    "others may be as near.",
    "range there": "95 % range: by the scatter of the measured mean, the other parameters fixed.",
    "belongs": "They depend on {settings}.",
    # responses, measured beside simulated
    "error": "Error = 100·(measured − simulated)/measured.",
    "scores": "Score: how far along a mode a curve is from the mean of the measured ones; its error is in % of the "
    "maximum force.",
    "validation": "Measured against simulated {response}",
    "largest": "Largest error {largest:fixed} %, mean {mean:fixed} % (absolute).",
    "largest of all": "Over all responses the largest error is {largest:fixed} %, the mean {mean:fixed} % (absolute).",
    "smaller": "Not shown, of smaller error: {count}; see the report.",
    "further": "Beside the {response}",
    "of stems": "Travel and work of the blade from first touch to the maximum force.",
    "strain by size": "Failure strain over element size",
    "strains": "The mean force over the positions of the mesh is {aim:.4g} N (stem of {at:g} mm); the search ends at "
    "the first strain within {tolerance:g} %. 95 % range: by the scatter over the positions. Valid: the mean and its "
    "standard error are within 5 %.",
    "valid": "yes",
    "not valid": "no",
    # runs
    "checks": "Checks of every run",
    "shares": "Failed: elements that had failed at the peak. Drift: largest error of the energy balance. Kinetic, "
    "hourglass: largest share of the internal energy on the way to the peak; small shares mean a quasi-static test.",
    "symbols": "Symbols as in the table of factors.",
    "failed": "failed",
    "failed for": "failed ({reason})",
    # the laboratory
    "readings": "{stems}, {readings} readings",
    "with range": "{value:.3f} (95 % {range})",
    "normal": "{value:.4f}, p {p:p}, normality not rejected",
    "not normal": "{value:.4f}, p {p:p}, normality rejected",
    "grades": "Together {share:.1f} % of the stems; the upper limit belongs to the next grade.",
    "shear": "Maximum shear force by grade",
    "measured tests": "What was measured in the tests",
    "outlier": "Outlier: by Grubbs' test, still included.",
    "growth": "F = {factor:significant 3}·d^{exponent:.2f}, F in N, d in mm, R² {r2:.3f} of the logarithms.",
    "known growth": "F = {factor:significant 3}·d^{exponent:.2f} (95 % {range}), F in N, d in mm, R² {r2:.3f} of the "
    "logarithms.",
    # what was varied, held and measured
    "measured": "Measured {responses:all}",
    "fitted at": "Bold: what the parameters are fitted to ({at:conditions}).",
    "fitted to all": "The parameters are fitted to all of them together.",
    "stem": "{outer_diameter:g} mm, bore {diameter_ratio:g} of it, {length:g} mm long",
    "solid stem": "{outer_diameter:g} mm, solid, {length:g} mm long",
    "walled stem": "{outer_diameter:g} mm, wall a factor, {length:g} mm long",
    "one bevel": "{thickness:g} mm thick, edge of {edge_angle:g}°, one side bevelled",
    "both bevels": "{thickness:g} mm thick, edge of {edge_angle:g}°, both sides bevelled",
    "supports": "{clearance:g} mm apart, edges rounded by {fillet_radius:g} mm",
    "loading": "{speed:significant} mm/min for {duration:g} s",
    "grows": "{value} at {at:g} mm, times (d / {at:g} mm)^{exponent}",
    "grown": "The material of each stem, calibrated",
    "by grade": "{values} at {diameters} mm, linear between",
    "friction": "{static_friction:g} at rest, {dynamic_friction:g} sliding",
    "half": "half, mirrored; elements of {size}",
    "quarter": "quarter, mirrored; elements of {size}",
    # captions and notes of published tables
    "published factors": "Screening test parameters.",
    "published screening-runs": "Design scheme and results of the screening test.",
    "published screening": "Significance analysis of the screening test parameters.",
    "published ascent": "Scheme and results of the steepest ascent test.",
    "published levels": "Factor coding of the response surface design.",
    "published surface-runs": "Test results and scheme of the response surface design.",
    "published anova": "ANOVA of the response surface.",
    "published calibration": "Parameter calibration values.",
    "published parameters": "Parameters of the simulation.",
    "published stem": "Finite element simulation parameters of the stem.",
    "published refinement": "Iterations of simulation and refitted surface.",
    "published validation": "Comparison of the measured and simulated {responses:all}.",
    "published stars": "** represents extremely significant effect (p < 0.01), * represents significant effect (p < "
    "0.05).",
    "coded": "{equation} (coded values).",
    "relative error": "Relative error = 100·(measured − simulated)/measured, measured {target:response .6g}.",
    "then": "Predicted by the surface before the run.",
    "served": "Error = 100·(measured − simulated)/measured; the {response} served for calibration and checks nothing.",
    "served at": "Error = 100·(measured − simulated)/measured; {at:conditions} served for calibration and checks "
    "nothing.",
    "served all": "Error = 100·(measured − simulated)/measured; {at:conditions} served for calibration and check "
    "nothing.",
}
"""Titles, lines of feet, captions and words of cells, by a name."""


def line(name: str, names: Names | Naming = CUTTING, /, **fields: object) -> str:
    """Return a line of a table; each knows the ``response``.

    >>> line("effects")
    'Effects on the maximum force'
    """
    names = Names(names) if isinstance(names, Naming) else names
    return names.say(LINES[name], **{"response": names.response.long, **fields})


def failed(reason: str) -> str:
    """Return what stands in place of the response of a run that failed."""
    return line("failed for", reason=reason) if reason else line("failed")
