"""What is withheld of the results where the study is not calibrated.

Intervals of the parameters and statements of agreement suppose that the model fits and its runs can be trusted. Where
the verdict is "not calibrated" they are not shown, and it is said that they are not.
"""

from __future__ import annotations

CLAIMING = ("profiles", "posterior", "solutions")  # figures of intervals
