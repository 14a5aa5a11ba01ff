"""What the terminal says of a run."""

from __future__ import annotations

from discovery.experiment.summary import rms_table


def test_a_difference_of_temperatures_is_in_kelvin() -> None:
    """rms of an error that is read in degC is no reading of a thermometer."""
    scores = {"T_head": {"rms": 0.4, "uncompensated": {"rms": 8.0}}}
    entry = {"terms": 3, "recordings": {"sun": scores}}
    results = {
        "fit": ["sun"],
        "held_out": [],
        "units": {"T_head": "degC"},
        "models": {"lumped": entry},
    }
    read = rms_table({"": results | {"roles": {"T_head": "temperature"}}}, "sun")
    assert read.rows[0][0] == "without a model"  # nobody compensates a temperature
    table = rms_table({"": results}, "sun")
    assert table.header == ("rms", "", "T_head [K]")
    assert table.rows == (("uncompensated", "", 8.0), ("lumped", "3 terms", 0.4))
