"""Reading a spec: from a YAML file to a `Study`, or to all problems in it with their lines and remedies."""

from stemcal.study.reading.read import load_study, read_study

__all__ = ["load_study", "read_study"]
