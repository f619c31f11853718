"""The study: spec, units, frozen data classes and the study folder."""
