"""The element in double precision, for answers that are known to round-off; studies never use it.

Only tests that call the element alone use it: a whole simulation in double precision takes a minute to compile.
"""

from stemcal.fem.model import Integration

EXACT = Integration(precision="double")
