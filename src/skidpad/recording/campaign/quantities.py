"""The main quantities of campaigns: one name for each, which pages, terminal and docs use, and no other.

Columns of results keep their names, as rules, files and other programs read them.
"""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Quantity:
    """What a campaign measures: its name, its columns, and names that texts must not use for it."""

    name: str
    columns: tuple[str, ...]  # that hold it; the rows of a campaign need not have all of them
    others: tuple[str, ...] = ()  # in the singular, where it has one


QUANTITIES = (
    Quantity(
        "interventions",
        ("fatal_collisions", "interventions"),
        ("fatal collision", "fatal event", "fatal crash", "fatal one"),
    ),
    Quantity("interventions, first of chain", ("fatal_first",), ("first fatal",)),
    Quantity("interventions per 100 km", ("fatal_per_100_km",)),
    Quantity("time to the first intervention", ("first_fatal_s",), ("time to the first crash",)),
    Quantity(
        "time to the first intervention, if no reset precedes",
        ("first_intervention_s",),
    ),
    Quantity("crashes", ("crashes",)),
    Quantity(
        "crashes with vehicles",
        ("crashes_vehicle",),
        (
            "vehicle crash",
            "vehicle collision",
            "collision with vehicle",
            "collision with a vehicle",
        ),
    ),
    Quantity("crashes with vehicles, first of chain", ("crashes_vehicle_first",)),
    Quantity("departures, first of chain", ("road_departures_first",)),
    Quantity("crashes with vehicles per 100 km", ("crashes_vehicle_per_100_km",)),
    Quantity(
        "departures",
        ("road_departures",),
        ("road departure", "departure from the road", "departure of the road"),
    ),
    Quantity("departures per 100 km", ("road_departures_per_100_km",)),
    Quantity(
        "serious contacts",
        ("serious_contacts",),
        (
            "severe contact",
            "serious collision",
            "severe collision",
            "serious crash",
            "severe crash",
        ),
    ),
    Quantity("serious contacts per 100 km", ("serious_contacts_per_100_km",)),
    Quantity("contacts", ("contacts",)),
    Quantity(
        "solid markings crossed",
        ("lane_invasions",),
        ("lane invasion", "solid line crossed", "solid lines crossed", "crossed solid"),
    ),
    Quantity("markings crossed of any kind", ("lane_invasions_all",)),
    Quantity("solid markings crossed on traced roads", ("lane_invasions_highway",)),
    Quantity("time with a TTC below 1.5 s", ("ttc_below_1_5_s",), ("TTC below 1.5, s",)),
    Quantity("dropout", ("dropout_pct",), ("dropout rate", "drop-out")),
    Quantity("mean distance error", ("mean_error_m",), ("mean error", "mean ranging error")),
    Quantity("variance of the distance error", ("headway_variance_m2",), ("headway variance",)),
    Quantity(
        "radar false positives",
        ("radar_fpr_pct",),
        ("radar FPR", "radar false positive rate", "false positive rate"),
    ),
    Quantity(
        "radar false negatives",
        ("radar_fnr_pct",),
        ("radar FNR", "radar false negative rate", "false negative rate"),
    ),
    Quantity("radar false positives of the pre-filter", ("radar_fpr_pct_pre",)),
    Quantity("radar false negatives of the pre-filter", ("radar_fnr_pct_pre",)),
    Quantity("radar false positives of the final decision", ("radar_fpr_pct_final",)),
    Quantity("radar false negatives of the final decision", ("radar_fnr_pct_final",)),
    Quantity("mean speed", ("mean_speed_kmh",), ("average speed",)),
    Quantity("speed in bends", ("bend_speed_kmh",), ("bend speed",)),
)
UNITS = {  # by the end of a column's name
    "_m": "m",
    "_m2": "m²",
    "_s": "s",
    "_kmh": "km/h",
    "_km": "km",
    "_pct": "%",
    "_pct_pre": "%",
    "_pct_final": "%",
    "_deg": "deg",
    "_deg_s": "deg/s",
}
ENDINGS = sorted(UNITS, key=len, reverse=True)
NAMES = {column: quantity.name for quantity in QUANTITIES for column in quantity.columns}


def name_of(column: str) -> str:
    """Returns the name of the quantity that a column of results holds, the column's own if it has none."""
    return NAMES.get(column, column)


def heading_of(column: str) -> str:
    """Returns the name of the quantity that a column holds with its unit, as "mean speed in km/h"."""
    if column not in NAMES:
        return column
    name, unit = NAMES[column], unit_of(column)
    return f"{name} in {unit}" if unit and not name.endswith(f"per 100 {unit}") else name


def unit_of(column: str) -> str:
    """Returns the unit that a column's ending stands for, "" without one."""
    return next((UNITS[end] for end in ENDINGS if column.endswith(end)), "")
