"""What every key of a spec means: for the schema, which editors show, and for the reference."""

from __future__ import annotations

__all__ = ["MEANINGS", "PLACES", "TOP"]

TOP = {
    "schema_version": "Version of the form of the spec; 1.",
    "name": "Name of the study, and of its folder below `runs`.",
    "title": "Title of the report and of its tables; the name by default.",
    "factors": "What is calibrated, in the order of their symbols X1, X2 and so on.",
    "responses": "What a run gives and the laboratory measures, where it is not the maximum force: a program may give "
    "several.",
    "conditions": "At what it is measured, where that is not the stem's diameter: one, or `[]` for none. Without "
    "`conditions` a study with `responses` has none.",
    "specimen": "The piece of stem.",
    "blade": "The rigid blade.",
    "supports": "The two rigid supports.",
    "loading": "How the blade moves.",
    "contact": "Friction and contact between stem, blade and supports.",
    "material": "Fixed values of the parameters that are no factors, and the length behind failure.",
    "failure": "How the stem fails: by a plastic strain, or by the toughness of the plane of the cut (experimental).",
    "solver": "What answers which force a set of levels gives.",
    "targets": "What the laboratory measured.",
    "screen": "Stage 1: which factors matter.",
    "climb": "Between stages 1 and 2: a walk towards the target; without this section there is none.",
    "rsm": "Stage 2: the response surface.",
    "invert": "Stage 3: the parameters that give the measured force.",
    "refine": "Stage 4: simulate at the solution and correct it; without this section it is left out.",
    "mesh": "Simulate the solution on other meshes; their scatter then enters every interval.",
    "runs": "What becomes of runs that fail.",
    "published": "A paper's printed results, to compare with and to audit.",
}

_REDUCED = {
    "file": "The file in the run folder that the program leaves.",
    "reduction": "How a series of numbers becomes one: its largest, smallest, first or last, the value `at` a place, "
    "the "
    "mean `over` a stretch, or the integral (work) along what it is plotted against.",
    "at": "For `reduction: at`: where, in the unit of what the series is plotted along; linear between points.",
    "over": "For `reduction: mean_over`: from and to.",
    "scale": "The number is multiplied by it: 4 for a quarter model, 1e-3 from mN.",
}
_PROGRAM = {
    "environment": "Further variables of the environment, by name.",
    "time_limit": "How long a run may take before it is ended with all its processes.",
    "files": "Files put beside each run under their own names.",
    "version": "Any text that tells versions of the program apart; another one computes all runs anew.",
    "keep": "Which run folders stay: those of failed runs, or all.",
}
_COMMAND = {"command": "The program and its arguments, as a list; it never passes through a shell."}
_MESH = {
    "elements_through_wall": "Elements through the wall; as many as make them no longer than `element_size` by "
    "default.",
    "hourglass": "Hourglass control of the one-point elements.",
    "mass_scaling": "Factor on all mass. Larger time steps, more kinetic energy: watch its share in the checks of the "
    "runs.",
    "time_step_safety": "Share of the stable time step that is taken.",
    "outputs": "Points of the force history.",
    "filter_window": "Window of the low-pass filter of the force; 0 s for none.",
}
_HOURGLASS = {
    "form": "Stiffness or viscous form.",
    "coefficient": "Strength; too small and elements fold, too large and the stem is too stiff.",
}

_RATE_LAW = (
    "How speed raises the yield stress: `paper` 1 + (rate/C)^P as printed in the wild chrysanthemum study, "
    "`cowper_symonds` 1 + (rate/C)^(1/P)."
)
_BREAK_DROP = (
    "The stem counts as broken, and the maximum as passed, once elements have failed and the force has dropped by this "
    "share of it."
)
_DECK = {
    **_PROGRAM,
    **_MESH,
    "interface": "Number of the contact whose force is read.",
    "scale": "The force is multiplied by it: 4 for a quarter model.",
    "break_drop": _BREAK_DROP,
    "element_size": "Length of the elements of the deck that stemcal writes.",
}

MEANINGS: dict[str, dict[str, str]] = {
    "Factor": {
        "name": "Name in tables and files. The embedded solver knows its nine material parameters, `stem_friction` "
        "(friction at any speed) and `wall_thickness` (at the calibration diameter; other stems have the same ratio); "
        "other programs any name.",
        "symbol": "Short sign in tables and equations; X1, X2, … by default.",
        "label": "What page and figures write; made from the name by default.",
        "unit": "Unit of `low` and `high`, and of its values in all results; 1 for pure numbers.",
        "low": "Lower end of the range that is searched.",
        "high": "Upper end of the range that is searched.",
        "expected_sign": "What mechanics says of its effect on the force: a screening that finds the other sign says "
        "so.",
    },
    "Response": {
        "name": "Name in tables and files; targets and `solver.result` give values under it.",
        "symbol": "Short sign in equations and along axes.",
        "label": "What page, figures and sentences write; made from the name by default.",
        "unit": "Unit of its values everywhere. Targets may be written in another unit of the same kind; a unit that "
        "stemcal does not know is shown as it is.",
    },
    "Condition": {
        "name": "Name in tables and files; targets give it under this name, templates as `{{name}}`.",
        "symbol": "Short sign in equations and along axes.",
        "label": "What page, figures and sentences write; made from the name by default.",
        "unit": "Unit of its values.",
    },
    "Specimen": {
        "outer_diameter": "Outer diameter where no other is asked for; targets have their own.",
        "diameter_ratio": "Diameter of the bore over the outer diameter; 0 for a solid stem.",
        "length": "Length of the piece, the blade at its middle.",
    },
    "Blade": {
        "length": "Length along the edge; for the record, it is longer than any stem.",
        "width": "Height from edge to back.",
        "thickness": "Thickness behind the edge faces.",
        "edge_angle": "Angle between the two faces of the edge.",
        "bevel": "Ground on both sides, or on one only.",
        "edge_radius": "Radius of the edge; 0 mm for a sharp one.",
        "edge_spread": "How far from its own profile the blade bears on the surface beside its edge: a length, or a "
        "share of the stem's diameter such as d/9.5. It belongs to the calibrated failure strain. 0 mm: the force "
        "belongs to the mesh.",
    },
    "Supports": {
        "clearance": "The gap between the two supports; the blade comes down in its middle.",
        "fillet_radius": "Radius of the supports' edges.",
    },
    "Loading": {
        "speed": "Speed of the blade, constant.",
        "duration": "How long it moves; speed times duration is the stroke.",
        "gap": "Distance of the edge from the stem at the start.",
    },
    "Contact": {
        "static_friction": "Coefficient of friction µs at rest.",
        "dynamic_friction": "Coefficient of friction µd when sliding fast.",
        "decay": "How fast friction falls from µs to µd with the sliding speed v: µ = µd + (µs − µd)·exp(−decay·|v|).",
        "penalty": "Stiffness of the contact, as a share of m/Δt² of each node (mass m, stable time step Δt).",
        "damping": "Damping of the contact, as a share of the critical one.",
    },
    "Material": {
        "density": "Mass density.",
        "elastic_modulus": "Young's modulus E.",
        "poisson_ratio": "Poisson's ratio.",
        "yield_stress": "Stress at which plastic flow begins, at rest.",
        "tangent_modulus": "Slope Et of the stress–strain curve beyond yield.",
        "hardening_parameter": "0 for kinematic hardening, 1 for isotropic, between for a mixture.",
        "strain_rate_c": "C of the strain-rate law; larger, the less speed strengthens. `solver.rate_law: none` "
        "switches rate dependence off.",
        "strain_rate_p": "P of the strain-rate law.",
        "failure_strain": "Plastic strain, averaged over the internal length, at which an element is removed.",
        "internal_length": "Length over which the plastic strain that decides failure is averaged: a length, or a "
        "share of "
        "the diameter such as d/4.5. 0 mm: element by element, and the force belongs to the mesh.",
    },
    "Failure": {
        "kind": "`strain`: elements are removed at `material.failure_strain`; `toughness`: the blade parts the plane "
        "of the cut, with neither failure strain nor `edge_spread` nor `internal_length`.",
        "strength": "Stress at which the plane of the cut begins to open in tension.",
        "toughness": "Energy that parting it takes, per area.",
    },
    "Hourglass": _HOURGLASS,
    "DeckHourglass": _HOURGLASS,
    "EmbeddedSolver": {
        **_MESH,
        "kind": "The solver that comes with stemcal.",
        "rate_law": f"{_RATE_LAW[:-1]}, `none` not at all.",
        "symmetry": "Which part is computed: the whole stem, half or a quarter of it; a quarter needs `bevel: both`.",
        "element_size": "Length of the elements under the edge: a length, or a share of the diameter such as d/16. At "
        "most 0.6 of `edge_spread` and `internal_length`.",
        "edge_over": "Whether the edge comes down on a row of nodes or over the middle of a row of elements.",
        "element": "One-point elements, or the slow fully integrated reference.",
        "precision": "`mixed`: strains, stresses and hourglass forces of the elements in single precision, all else in "
        "double; `double`: everything.",
        "time_step": "Elements too small for this step are given mass until they can take it; without it none is "
        "given.",
        "coarsening": "Length of the elements at the ends of the stem over those under the edge.",
        "coarsening_around": "Width of the elements at the bottom of the section over those under the edge.",
        "phases": "The force is the mean over so many places of the mesh under the edge.",
        "perturb": "Seed of a random place of the mesh, for tests of how much that matters.",
        "break_drop": _BREAK_DROP,
        "stop_after_peak": "End a simulation there; `false` computes the whole stroke.",
        "failure_length": "Crack-band length: each element fails at the failure strain times this over its own "
        "length. It "
        "is another way to what `internal_length` does.",
        "threads": "Threads of one simulation, for a single large model; runs beside each other are `--workers`.",
    },
    "TableSolver": {
        "kind": "Tables answer in place of a solver.",
        "screen": "CSV of the screening's runs: columns named by factor, the force last.",
        "rsm": "CSV of the surface's runs, likewise.",
        "validate": "CSV of diameters and simulated forces.",
    },
    "CommandSolver": {
        **_COMMAND,
        **_PROGRAM,
        "kind": "Any program that reads text and leaves a number.",
        "templates": "Text files in which `{{factor}}` stands for a factor's value, `{{diameter}}` for the stem's in "
        "mm; in a program with chance in it `{{seed}}` for a whole number, another one in every run, and "
        "`{{replicate}}`.",
        "result": "Where the program leaves its number; of several responses a mapping of such readers by their names.",
        "results": "The same by the names of the responses.",
        "deterministic": "Whether equal inputs give equal answers: if true, one run is repeated at the start to see "
        "it; if false, every run is simulated anew, centre points too. Not said, it is taken for true and not tried.",
        "replicates": "How often every run of a design is simulated, each time with a seed of its own; more than one "
        "means that there is chance in the program.",
        "seed": "Draws other seeds for all runs.",
    },
    "LsDynaSolver": {
        **_COMMAND,
        **_DECK,
        "kind": "LS-DYNA.",
        "deck": "Your own deck of the stem at the calibration diameter; without it stemcal writes one.",
        "decks": "Your own decks of other diameters.",
        "material": "Number of the material in your deck whose nine values are replaced; the only MAT_003 by default.",
        "component": "Direction of the force.",
    },
    "OpenRadiossSolver": {
        **_DECK,
        "kind": "OpenRadioss.",
        "home": "Folder of the installation, with `exec` and `hm_cfg_files` in it; by default what the environment "
        "variable `OPENRADIOSS_PATH` names.",
        "starter": "Name or path of the starter, where `home` has none of the usual name.",
        "engine": "The same of the engine.",
        "th_to_csv": "The same of the program that makes a table of the time histories.",
        "threads": "Threads of one run (`OMP_NUM_THREADS`, `-nt`).",
        "rate_law": _RATE_LAW,
    },
    "DeckAt": {"diameter": "Outer diameter of the stem in the deck.", "deck": "The deck."},
    "JsonResult": {
        **_REDUCED,
        "kind": "A JSON file.",
        "path": "Keys and indices joined by points: `history.force` or `rows.0.force`.",
        "along": "The same, of what the series is plotted along.",
    },
    "CsvResult": {
        **_REDUCED,
        "kind": "A CSV file with a header.",
        "column": "Name of the column.",
        "along": "Name of the column it is plotted against.",
    },
    "RegexResult": {
        **_REDUCED,
        "kind": "A text file, searched line by line.",
        "pattern": "Regular expression; the group called y, or the first, is the number, a group x what it is plotted "
        "along.",
    },
    "RcforcResult": {
        **_REDUCED,
        "kind": "LS-DYNA's ASCII rcforc.",
        "interface": "Number of the contact.",
        "component": "Direction of the force.",
    },
    "CalculixResult": {
        **_REDUCED,
        "kind": "CalculiX's .dat.",
        "set": "Name of the set that is printed.",
        "quantity": "What is printed, called as there.",
        "component": "Its component, called as there.",
        "node": "The one node of the set; forces are summed over the set without it.",
    },
    "Target": {
        "diameter": "Outer diameter of the stems.",
        "force": "Mean of their maximum shear force.",
        "sd": "Standard deviation of it over the stems; without it the mean is taken as exact.",
        "n": "Number of stems.",
        "travel": "How far the blade had come from first touch to the maximum, mean.",
        "travel_sd": "Standard deviation of the travel.",
        "work": "Work the blade had done by then, mean.",
        "work_sd": "Standard deviation of the work.",
    },
    "Targets": {
        "calibrate_at": "The diameter whose force the parameters are fitted to; the others check them.",
        "forces": "The measured forces, an entry per diameter.",
        "equivalent_within_percent": "Up to here a simulated force counts as equal to the measured one: in the "
        "verdict, and "
        "as the margin of the equivalence test.",
    },
    "ScreenOptions": {
        "design": "The design; `stemcal plan` tells what it can find.",
        "runs": "Another number of runs than the usual one: of Plackett–Burman 12 for 5 to 11 factors.",
        "centre_points": "Runs in the middle of all ranges: they tell whether the response is curved, and its scatter.",
        "fold_over": "Repeat every run with all signs turned: main effects clear of two-factor interactions.",
        "error": "What effects are tested against: columns without a factor, those pooled with small effects, repeated "
        "runs, or Lenth's pseudo standard error.",
        "alpha": "A factor whose p is below goes on to the surface.",
    },
    "ClimbOptions": {
        "steps": "Steps from the middle to the edge of the ranges.",
        "step_sizes": "Steps of one's own, in the units of the factors by their names; `steps` is then the most of "
        "them.",
        "shrink": "Share of each range over which the surface's design reaches, around the best step.",
    },
    "CodingEntry": {
        "center": "The value that coded 0 means, in the factor's unit.",
        "half_step": "What coded +1 is above it.",
    },
    "Constraint": {
        "of": "A coefficient for each factor in it.",
        "at_most": "What the sum of coefficients times levels may not exceed.",
    },
    "RsmOptions": {
        "design": "The design; all but Box–Behnken (3 to 7 factors) take any number of factors.",
        "factors": "The significant ones of the screening, `strongest 3` of it, or a list of names, which makes the "
        "screening unnecessary for it.",
        "centre_points": "Runs at the centre. The embedded solver gives the same force each time: one teaches as much "
        "as six.",
        "alpha": "How far the axial points lie out, by a rule or in coded units.",
        "core": "All corners, or a fraction of them from five factors on.",
        "runs": "Number of runs of the space-filling designs.",
        "seed": "Seed of the space-filling designs.",
        "extra_runs": "Further runs where they teach most (D-optimal); a list adds batch after batch.",
        "axial": "Adds axial points at this coded distance.",
        "blocks": "`orthogonal` splits a composite into corners and axial points, each with a level of its own.",
        "weights": "`phases` lets runs of small scatter over `solver.phases` count more.",
        "inestimable": "Whether terms that failed runs have made inestimable are left out or end the fit.",
        "reduce": "How terms are left out: none, backward, forward or by AICc; hierarchy is kept.",
        "reduce_alpha": "The p from which backward and forward leave a term out.",
        "sums_of_squares": "What a term of the analysis of variance is asked to explain: what all other terms leave "
        "(type III), or what the terms before it leave (type I, in the order of `factors`).",
        "constraints": "What an I-optimal design has to keep to, in the units of the factors.",
        "coarse": "Run the design with larger elements, which is faster, and correct the surface by a few runs with "
        "the study's own.",
        "coding": "What coded 0 and +1 mean, by factor; others get theirs from their range.",
    },
    "CoarseOptions": {
        "element_size": "Size of the elements in the runs of the design, such as `d/10`; larger than "
        "`solver.element_size`, which refinement, validation and the calibrated values keep.",
        "fine_runs": "How many runs of the design are made with the study's own elements too: with three more than "
        "there are factors the correction has a slope along each, with fewer it is one factor on the force.",
    },
    "InvertOptions": {
        "rule": "Which of the points that give the force is the solution: the nearest to the centre, the best "
        "predicted, or "
        "the one with all factors but the strongest at their centre.",
        "diameters": "Fit several diameters at once: `all`, or a list. The surface's design is then run at each.",
        "conditions": "The same where `conditions` names the study's own: `diameters` by its name there.",
        "responses": "What is fitted: the force alone, or also travel and work to the maximum.",
        "posterior": "Sample what the forces leave possible (extra `bayes`).",
        "ranges_chosen": "Whether the factors' ranges were fixed before the measured forces were seen; after that no "
        "diameter that is left out is an independent check.",
        "desirability": "Put the most desirable point (Derringer and Suich) beside the fit; by default where the study "
        "declares several responses.",
        "discrepancy": "What the model misses over the fitted diameters: one `scale` with scatter, or a `process` that "
        "changes smoothly with the diameter. Gives prediction intervals of the measured forces.",
    },
    "RefineOptions": {
        "tolerance_percent": "Done once the simulated force is within this of the measured one.",
        "budget": "Most simulations it may take.",
        "model": "What proposes the points: the `quadratic`, a Gaussian `process`, or the `better` one at predicting "
        "the design's runs left out.",
        "batch": "How many points a Gaussian process proposes at a time; they are simulated together.",
    },
    "RunsOptions": {
        "tries": "How often a run is begun that ends by accident: its process died, the solver raised an exception.",
        "time_limit": "How long one run may take, counted from its start; as long as it needs by default.",
        "quorum": "Share of a stage's runs that must succeed.",
        "keep_going": "`false` stops a stage at its first failure.",
        "censored": "What a force counts as that still rises when the stroke ends: a bound that is warned of, or a "
        "failure.",
    },
    "MeshOptions": {
        "phases": "Places of the mesh along the stem.",
        "sizes": "Further element sizes, lengths or shares of the diameter such as `d/24`.",
    },
    "Published": {
        "screening": "CSV of the printed effects.",
        "coefficients": "CSV of the printed coefficients.",
        "anova": "CSV of the printed analysis of variance.",
        "solution": "The printed parameters, by factor.",
        "validation": "CSV of the printed validation.",
        "levels": "CSV of the printed low and high levels.",
        "design": "CSV of the printed design.",
        "claims": "Single printed numbers, by name, as text just as printed.",
        "runs": "Whether the printed forces were `computed` (repeated runs must then agree) or `measured`.",
        "bounds": "Whether the printed equation was searched within bounds in `coded` or in `natural` values.",
        "rate_law": "What the paper calls its rate law, held against the exponent that it prints.",
        "called": "What the paper calls a factor, by its name here.",
    },
}

# Where in a spec the keys of a class stand.
PLACES = {
    "Factor": "factors[]",
    "Response": "responses[]",
    "Condition": "conditions[]",
    "Specimen": "specimen",
    "Blade": "blade",
    "Supports": "supports",
    "Loading": "loading",
    "Contact": "contact",
    "Material": "material",
    "Failure": "failure",
    "EmbeddedSolver": "solver, kind: embedded",
    "Hourglass": "solver.hourglass, kind: embedded",
    "TableSolver": "solver, kind: table",
    "CommandSolver": "solver, kind: command",
    "JsonResult": "solver.result, kind: json",
    "CsvResult": "solver.result, kind: csv",
    "RegexResult": "solver.result, kind: regex",
    "RcforcResult": "solver.result, kind: rcforc",
    "CalculixResult": "solver.result, kind: calculix",
    "LsDynaSolver": "solver, kind: lsdyna",
    "OpenRadiossSolver": "solver, kind: openradioss",
    "DeckAt": "solver.decks[], kind: lsdyna",
    "DeckHourglass": "solver.hourglass, kind: lsdyna, openradioss",
    "Targets": "targets",
    "Target": "targets.forces[]",
    "ScreenOptions": "screen",
    "ClimbOptions": "climb",
    "RsmOptions": "rsm",
    "Constraint": "rsm.constraints",
    "CoarseOptions": "rsm.coarse",
    "CodingEntry": "rsm.coding.FACTOR",
    "InvertOptions": "invert",
    "RefineOptions": "refine",
    "MeshOptions": "mesh",
    "RunsOptions": "runs",
    "Published": "published",
}
