"""Tables of the envelope's proof, made of results that are known, and how far it must be driven."""

from __future__ import annotations

import sys
from pathlib import Path

import polars as pl
import pytest
from scipy import stats

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "tools"))

import envelope_power as power  # noqa: E402
import result_envelope as proof  # noqa: E402

SEEDS = range(1, 13)


def write_runs(folder: Path, contacts: dict[str, int], speed: float = 40.0) -> None:
    """Twelve seeds of 5 km for each configuration, with so many contacts in each run."""
    rows = [
        {
            "config": config, "weather": weather, "seed": seed, "distance_km": 5.0,
            "mean_speed_kmh": speed + seed % 3, "serious_contacts": n if weather == "snow" else 0,
            "road_departures": 0, "rear_ended": 1, "motion_hash": f"{weather} {seed} {n}",
        }
        for config, n in contacts.items()
        for weather in ("snow", "clear-noon")
        for seed in SEEDS
    ]  # fmt: skip
    folder.mkdir(parents=True)
    pl.DataFrame(rows).write_parquet(folder / "results.parquet")


def rows_of(text: str, weather: str) -> dict[str, list[str]]:
    rows = [[c.strip() for c in line.strip("|\n").split("|")] for line in text.splitlines()]
    return {row[1]: row for row in rows if row[0] == weather}


def test_a_factor_is_printed_only_where_the_bare_stack_has_30_events(tmp_path):
    write_runs(tmp_path / "envelope-figure8", {"3": 3, "5": 0})
    snow = rows_of(proof.rivals(tmp_path / "envelope-figure8"), "snow")
    dry = rows_of(proof.rivals(tmp_path / "envelope-figure8"), "clear-noon")
    assert snow["bare"][6].startswith("60.0 (")
    assert snow["envelope"][7] == f"above {power.factor_bound(36, 0):.1f}"
    assert dry["envelope"][7] == "too few (0)"


def test_a_map_in_sum_counts_slippery_weathers_only(tmp_path):
    write_runs(tmp_path / "envelope-foreign-town", {"3": 3, "5": 1})
    own = pl.read_parquet(tmp_path / "envelope-foreign-town" / "results.parquet")
    dry = pl.col("weather") == "clear-noon"
    own = own.with_columns(
        pl.when(dry).then(7).otherwise("serious_contacts").alias("serious_contacts")
    )
    own.write_parquet(tmp_path / "envelope-foreign-town" / "results.parquet")
    text = proof.in_sum(tmp_path / "envelope-foreign-town")
    rows = {line.split("|")[1].strip(): line for line in text.splitlines()}
    assert "| 36 + 0 in 60 km |" in rows["bare"]
    assert f"| 3.0 (above {power.factor_bound(36, 12):.1f}) |" in rows["envelope"]


def test_rivals_lie_beside_and_the_table_is_tested_by_seed(tmp_path):
    write_runs(tmp_path / "envelope-figure8", {"3": 3, "5": 0})
    write_runs(tmp_path / "envelope-figure8-table", {"3": 2})
    snow = rows_of(proof.rivals(tmp_path / "envelope-figure8"), "snow")
    dry = rows_of(proof.rivals(tmp_path / "envelope-figure8"), "clear-noon")
    assert float(snow["envelope"][9]) < 0.05
    assert float(dry["envelope"][9]) == 1.0
    assert snow["table of three speeds"][4] == "24"


def test_weathers_in_which_all_moved_alike_count_once(tmp_path):
    folder = tmp_path / "envelope-figure8"
    write_runs(folder, {"3": 3, "5": 0})
    runs = pl.read_parquet(folder / "results.parquet")
    again = runs.with_columns(
        pl.col("weather").replace({"snow": "blizzard", "clear-noon": "clear-night"})
    )
    differs = again.with_columns(
        pl.when(weather="clear-night", config="5").then(pl.lit("x")).otherwise("motion_hash").alias(
            "motion_hash"
        )
    )  # fmt: skip
    pl.concat([runs, differs]).write_parquet(folder / "results.parquet")
    weathers = {row[0] for row in proof.cells(folder)}
    assert weathers == {"snow, blizzard", "clear-noon", "clear-night"}
    assert proof.events(proof.read_drivers(folder)["bare"]) == 36


def test_a_weather_with_one_seed_joins_its_group_and_a_rival_may_have_any_of_them(tmp_path):
    """As --distinct drives them: the first seed of each weather, the rest of one alone."""
    folder = tmp_path / "envelope-figure8"
    write_runs(folder, {"3": 3, "5": 0})
    runs = pl.read_parquet(folder / "results.parquet")
    other = pl.col("weather").replace({"snow": "blizzard"})
    once = runs.filter(weather="snow", seed=SEEDS[0]).with_columns(other)
    pl.concat([once, runs]).write_parquet(folder / "results.parquet")
    write_runs(tmp_path / "envelope-figure8-table", {"3": 2})
    table = pl.read_parquet(tmp_path / "envelope-figure8-table" / "results.parquet")
    table.with_columns(other).write_parquet(tmp_path / "envelope-figure8-table" / "results.parquet")
    drivers = dict(proof.cells(folder))["blizzard, snow"]
    assert {n: proof.events(t) for n, t in drivers.items()} == {
        "bare": 36, "envelope": 0, "table of three speeds": 24,
    }  # fmt: skip


def test_a_driver_that_moved_alike_alone_is_whole_in_both_weathers(tmp_path):
    """--distinct decides for each configuration: the envelope is driven once, the bare stack twice."""
    folder = tmp_path / "envelope-figure8"
    write_runs(folder, {"3": 3, "5": 0})
    runs = pl.read_parquet(folder / "results.parquet")
    other = runs.filter(weather="snow").with_columns(pl.lit("blizzard").alias("weather"))
    bare = other.filter(config="3").with_columns(pl.lit("x").alias("motion_hash"))
    once = other.filter(config="5", seed=SEEDS[0])
    pl.concat([runs, bare, once]).write_parquet(folder / "results.parquet")
    found = dict(proof.cells(folder))
    assert {w: len(t["envelope"]) for w, t in found.items()} == dict.fromkeys(
        ("snow", "blizzard", "clear-noon"), len(SEEDS)
    )


def test_goals_are_judged_over_the_maps_that_are_driven(tmp_path):
    for name in proof.MAPS[:2]:
        write_runs(tmp_path / name, {"3": 3, "5": 0}, speed=36.0)
        write_runs(tmp_path / f"{name}-table", {"3": 2})
        write_runs(tmp_path / f"{name}-oracle", {"3": 0})
    text = proof.goals(tmp_path / proof.MAPS[0])
    assert text.startswith("2 of 3 maps.")
    rows = {
        line.split("|")[1].strip(): line.split("|")[2:]
        for line in text.splitlines()[2:]
        if "|" in line
    }
    bare, table, envelope, by_bare, contacts, by_table, speed, faster, p_bare, p_table = (
        cell.strip() for cell in rows["snow"][:10]
    )
    assert (bare, table, envelope) == ("72 + 0 in 120 km", "48 + 0 in 120 km", "0 + 0 in 120 km")
    assert "36 + 0 in 60 km" in rows["the same on motorway"][0]
    assert contacts == by_bare == f"above {power.factor_bound(72, 0):.1f}"
    assert by_table == f"above {power.factor_bound(48, 0):.1f}"
    assert speed == f"{100 * 37 / 41:.0f} %"
    assert faster.startswith("-4.0 (")
    assert max(float(p_bare), float(p_table)) < 0.01
    assert rows["dry"][5].strip() == "too few (0)"


@pytest.mark.parametrize(("contacts", "verdict"), [(1, "not worse"), (5, "worse")])
def test_a_cell_is_worse_where_events_are_more_by_the_margin(tmp_path, contacts, verdict):
    write_runs(tmp_path / proof.MAPS[0], {"3": 3, "5": contacts})
    rows = rows_of(proof.worse(tmp_path / proof.MAPS[1]), "figure8")
    assert rows["snow"][6] == verdict
    assert rows["snow"][4].startswith(f"{20.0 * (contacts - 3):+.1f} (")
    assert rows["clear-noon"][6] == "not worse"


def test_a_cell_of_few_seeds_that_scatter_is_too_small_to_say(tmp_path):
    folder = tmp_path / proof.MAPS[0]
    write_runs(folder, {"3": 1, "5": 1})
    runs = pl.read_parquet(folder / "results.parquet")
    scattered = pl.when((pl.col("config") == "5") & (pl.col("seed") == 1)).then(9)
    runs.with_columns(
        serious_contacts=scattered.otherwise(pl.col("serious_contacts"))
    ).write_parquet(folder / "results.parquet")
    assert rows_of(proof.worse(folder), "figure8")["snow"][6] == "too few to say"


def test_a_factor_is_of_events_per_km(tmp_path):
    assert proof.factor_text(40, 4, 0.5) == f"5.0 (above {0.5 * power.factor_bound(40, 4):.1f})"


def test_the_picture_has_every_driver(tmp_path):
    folder = tmp_path / "envelope-figure8"
    write_runs(folder, {"3": 3, "4": 2, "5": 0})
    assert "pareto.svg" in proof.pareto(folder)
    svg = (folder / "pareto.svg").read_text(encoding="utf-8")
    assert all(name in svg for name in ("bare", "fixed 80 km/h", "envelope"))


@pytest.mark.parametrize(("bare", "governed"), [(30, 3), (10, 10), (36, 0)])
def test_at_the_bound_of_a_factor_as_many_bare_events_have_a_chance_of_5_percent(bare, governed):
    bound = power.factor_bound(bare, governed)
    chance = stats.binom.sf(bare - 1, bare + governed, bound / (1.0 + bound))
    assert chance == pytest.approx(power.LEVEL, rel=1e-6)


def test_more_events_or_a_larger_effect_need_less_distance():
    rare, often = (power.chance_to_show(rate, 200.0, 10.0, 3.0) for rate in (5.0, 30.0))
    assert rare < 0.8 < often
    assert power.chance_to_show(12.0, 200.0, 3.0, 3.0) <= 0.06, "its level holds"


def test_the_page_has_the_table_of_the_power():
    page = (ROOT / "docs" / "envelope-proof.md").read_text(encoding="utf-8")
    assert "| 30 | 100 | 126 | 142 |" in page
    assert power.needed_km(30.0, 10.0, 3.0) == pytest.approx(126.0, abs=0.5)


def test_a_route_is_told_by_what_was_driven_of_it_and_compared_by_seed(tmp_path):
    folder = tmp_path / "envelope-route"
    write_runs(folder, {"3": 3, "5": 0})
    runs = pl.read_parquet(folder / "results.parquet").with_columns(
        pl.lit(100.0).alias(proof.COMPLETION),
        pl.when(pl.col("config") == "5").then(100.0).otherwise(20.0 + pl.col("seed")).alias(
            proof.UNAIDED
        ),
    )  # fmt: skip
    runs.write_parquet(folder / "results.parquet")
    snow = rows_of(proof.routes(folder), "snow")
    assert snow["bare"][3:6] == ["100 (12)", "26 (0)", ""]
    assert snow["envelope"][3:5] == ["100 (12)", "100 (12)"]
    assert snow["envelope"][5].startswith("+74 (+7")


def test_ten_seeds_of_3_km_have_power_where_there_are_many_events():
    assert power.chance_to_show(200.0, power.ROUTES, 8.0, power.LEAST) > power.POWER
    assert power.chance_to_show(30.0, power.ROUTES, 8.0, power.LEAST) < 0.2
