"""Reading a spec: from a YAML file to a `Study`, or to every problem in it with its line and what to do."""

from stemcal.study.reading.read import load_study, read_study

__all__ = ["load_study", "read_study"]
