"""Numbers, units and lists of words as tables and sentences write them."""

from stemcal.formats import (
    change,
    counted,
    decimals,
    direction,
    duration,
    fixed,
    in_bytes,
    interval,
    listed,
    nearest,
    outwards,
    percent,
    probability,
    series,
    short,
    signed_probability,
    significant,
    unit_written,
    with_unit,
)


def test_numbers() -> None:
    values = (18921.0208, 0.18750, 17.96, None)
    assert [significant(value) for value in values] == ["18921", "0.1875", "17.96", "–"]
    assert interval([17.6258, 18.9641]) == "17.63 to 18.96"
    assert interval([10, 18.9641], bounded=(False, True)) == "≤ 10.00 to 18.96"
    assert [short(value) for value in (1100.0, 0.30000000000000004, 14.995)] == ["1100", "0.3", "14.995"]
    assert [fixed(value) for value in (-4.75, -0.001)] == ["−4.75", "0.00"]
    assert [percent(value) for value in (60.19, 0.0006, -7.83)] == ["60.19", "0.001", "−7.83"]
    assert (outwards(44.2, True), outwards(0.0373, False), outwards(0.0, False)) == (45.0, 0.037, 0.0)
    assert (decimals([74.69, -8.0], 1), decimals([0.0312, None], 2)) == (1, 4)
    assert (direction(3.8312), direction(-0.52, " %", 1)) == ("3.83 too low", "0.5 % too high")
    assert (direction(0.001), direction(None)) == ("0.00", "–")


def test_p_values() -> None:
    assert [probability(p) for p in (5.3e-8, 0.04619, None)] == ["<0.0001", "0.0462", "–"]
    assert [signed_probability(p) for p in (5.3e-8, 0.04619)] == ["< 0.0001", "= 0.0462"]


def test_units() -> None:
    assert [unit_written(unit) for unit in ("kg/m3", "MPa", "1")] == ["kg/m³", "MPa", ""]
    assert [with_unit("1100", "kg/m3"), with_unit("0.3", "1")] == ["1100 kg/m³", "0.3"]
    assert change("yield_stress", -1.9, "MPa") == "yield_stress decreases by 1.9 MPa"
    assert change("failure_strain", 0.0141, "1") == "failure_strain increases by 0.0141"


def test_time_and_memory() -> None:
    times = {0.004: "under 1 s", 48.2: "48 s", 600: "10 min", 9000: "2 h 30 min", 7.2e7: "833 days", None: "unknown"}
    assert {time: duration(time) for time in times} == times
    sizes = (2.5e8, 7.1e9, 3e15, float("inf"), None)
    assert [in_bytes(size) for size in sizes] == ["0.2 GB", "7.1 GB", *["more than 1000 TB"] * 2, "–"]


def test_words() -> None:
    assert nearest("yeild_stress", ["density", "yield_stress"]) == "yield_stress"
    assert listed(["a", "b", "c"]) == "a, b or c"
    assert (counted(1, "run"), counted(12, "run")) == ("1 run", "12 runs")
    assert [series(["a"]), series(["a", "b"], "or"), series(["a", "b", "c"])] == ["a", "a or b", "a, b and c"]
