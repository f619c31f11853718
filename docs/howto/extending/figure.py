# ruff: noqa: D100, D103, I001
# fmt: off
from matplotlib.figure import Figure
from stemcal.formats import fixed
from stemcal.drawing.plot import Plot

def outcome(self, result, names):
    return [f"In the middle of the ranges, the maximum force is {fixed(result.force, 1)} N."]

def figures(self, result, setting):
    def draw():
        figure = Figure(figsize=(4, 3), layout="constrained")
        figure.subplots().bar(["middle"], [result.force])
        return figure

    return [Plot("middle", "middle", "Force in the middle of the ranges.", draw)]
