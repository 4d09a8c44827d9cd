"""Rows of the matrix: one per run. Every metric is a field with its meaning and its source (A-252)."""

from __future__ import annotations

from dataclasses import dataclass

from skidpad.recording.campaign.ledger import Entry
from skidpad.recording.campaign.results import Columns, metric


@dataclass(frozen=True, slots=True, kw_only=True)
class RunKey:
    """Which run a row is about, and how it ended."""

    config: str  # "0" to "4", a set of functions, or module:Class
    weather: str  # name of the weather
    precipitation_kind: str  # "clear" or "rain"
    time_of_day: str  # "sunrise", "noon", "night"; "" for other weathers
    seed: int  # seed of the run
    profile: str  # name of the profile of settings
    map: str  # name of the map, or path of its file
    sensors: str  # objects or pixels
    grip: str  # model of grip
    range: str  # model of sight
    outcome: str  # how the run ended
    functions: str = ""  # "acc+lca"; "": unknown, or none
    cruise_kmh: float | None = None  # target of free cruise; None: unknown
    traffic: str = ""  # where background vehicles start
    version: str = ""  # of Skidpad
    log_hash: str | None = None  # content hash of the tick log: the promise of reproducibility
    motion_hash: str | None = None  # of poses, contacts, commands; equal hashes are one drive
    vehicles_missing: int | None = None  # asked for, but the map has no place for them


@dataclass(frozen=True, slots=True, kw_only=True)
class Metrics:
    """What the log of one run says; None where there is nothing to say (decision X-3)."""

    # collisions
    fatal_collisions: int | None = metric("recoveries, wrong ways and departures", "A-247, R-6")
    crashes_vehicle: int | None = metric(
        "interventions after a contact with a vehicle", "A-190, R-6"
    )
    road_departures: int | None = metric(
        "into a barrier, off the road, facing the wrong way, or rolled over", "R-6"
    )
    collisions_vehicle: int | None = metric("recoveries after hitting a vehicle", "A-190")
    collisions_static: int | None = metric("recoveries after hitting anything else", "A-190")
    off_road: int | None = metric("times that the car left the road and was put back", "R-6")
    wrong_way: int | None = metric("wrong-way corrections", "A-199")
    roll_overs: int | None = metric("times that the car lay on its side", "T-11")
    fatal_first: int | None = metric(
        "interventions that follow on no relocation (8 s, 100 m)", "R-6"
    )
    crashes_vehicle_first: int | None = metric("of these with vehicles", "R-6")
    road_departures_first: int | None = metric(
        "of these static, off the road, wrong way, rolled over", "R-6"
    )
    first_fatal_s: float | None = metric(
        "time to the first intervention; none: beyond the run", "R-6"
    )
    contacts: int | None = metric("contacts, also those within the cool-down", "A-189")
    rear_ended: int | None = metric(
        "of collisions_vehicle: struck from behind; until the morning of 2026-11-25 also at the side",
        "M-8",
    )
    bend_exits: int | None = metric(
        "static, off the road, rolled over: in a bend without a lead", "M-6"
    )
    stuck_relocations: int | None = metric("relocations of a stuck ego, no interventions", "A-253")
    max_impact_kmh: float | None = metric("largest closing speed at a collision", "A-249")
    max_impact_vehicle_kmh: float | None = metric("the same, with a vehicle", "F-05")
    # severity: contacts with road users by delta-v, the larger of the two (T-4)
    serious_contacts: int | None = metric("5 km/h or more, or with a person or two wheels", "T-4")
    contacts_light: int | None = metric("contacts with road users below 5 km/h", "T-4")
    contacts_medium: int | None = metric("the same, 5 to 20 km/h", "T-4")
    contacts_heavy: int | None = metric("the same, above 20 km/h", "T-4")
    contacts_vulnerable: int | None = metric("of these with persons or two wheels", "T-4")
    contacts_by_closing_speed: int | None = metric("of these graded by closing speed", "T-4")
    contacts_repeated: int | None = metric("the same one touched again within 8 s", "T-4")
    contacts_static: int | None = metric("contacts with all that is no road user", "T-4")
    max_delta_v_kmh: float | None = metric("largest delta-v at a contact with a road user", "T-4")
    interventions: int | None = metric(
        "times put back after a crash; published as fatal collisions", "T-4"
    )
    first_intervention_s: float | None = metric("time to the first, if no reset precedes", "T-5")
    undisturbed_s: float | None = metric("time to the first reset, else of the run", "T-5")
    # lanes
    lane_invasions: int | None = metric("solid markings crossed", "A-030, A-248")
    lane_invasions_all: int | None = metric("markings crossed, of any kind", "A-248")
    lane_invasions_highway: int | None = metric("of the solid ones: on traced roads", "A-032")
    lane_changes: int | None = metric("broken markings crossed, once per 12 s", "A-031")
    lateral_mean_m: float | None = metric("distance from the lane centre, mean", "A-245")
    lateral_max_m: float | None = metric("distance from the lane centre, largest", "A-245")
    lateral_std_m: float | None = metric("distance from the lane centre, deviation", "A-245")
    # conflicts, as the stack saw them
    min_ttc_s: float | None = metric("least time to collision", "A-234")
    min_ttc_above_10_kmh_s: float | None = metric("the same at more than 10 km/h", "A-254")
    ttc_below_1_5_s: float | None = metric("time with a time to collision below 1.5 s", "A-234")
    ttc_critical_count: int | None = metric("ticks with one below 1.5 s", "A-234")
    # conflicts, in truth
    min_ttc_true_s: float | None = metric("least true time to collision in lane", "M-8")
    max_drac_true: float | None = metric("largest deceleration needed, m/s2", "M-8")
    min_gap_true_m: float | None = metric("least true gap to the lead while driving", "M-8")
    # perception
    radar_fpr_pct: float | None = metric("radar false positives, lane-checked", "A-238")
    radar_fnr_pct: float | None = metric("radar false negatives, lane-checked", "A-238")
    radar_fpr_pct_pre: float | None = metric("the same after the pre-filter", "A-239")
    radar_fnr_pct_pre: float | None = metric("the same after the pre-filter", "A-239")
    radar_fpr_pct_final: float | None = metric("the same of the final decision", "A-239")
    radar_fnr_pct_final: float | None = metric("the same of the final decision", "A-239")
    tp: int | None = metric("ticks: lane-checked return, vehicle there", "A-252")
    fp: int | None = metric("ticks: lane-checked return, no vehicle", "A-252")
    tn: int | None = metric("ticks: no return, no vehicle", "A-252")
    fn: int | None = metric("ticks: no return, vehicle there", "A-252")
    mean_error_m: float | None = metric("distance error, mean", "A-240")
    max_error_m: float | None = metric("distance error, largest", "A-240")
    max_error_at_s: float | None = metric("when the distance error was largest", "A-254")
    headway_variance_m2: float | None = metric("population variance of that error", "A-241")
    gap_variance_m2: float | None = metric("variance of the true gap while following", "A-242")
    dropout_pct: float | None = metric("ticks without a target or persisting", "A-243")
    dropout_present_pct: float | None = metric("the same with a vehicle truly there", "A-244")
    # driving
    mean_speed_kmh: float | None = metric("ego speed, mean", "A-249")
    max_speed_kmh: float | None = metric("ego speed, largest", "A-249")
    p50_speed_kmh: float | None = metric("ego speed, median", "A-249")
    p95_speed_kmh: float | None = metric("ego speed, 95th percentile", "A-249")
    bend_speed_kmh: float | None = metric("ego speed in bends, 95th percentile", "F-05")
    distance_km: float | None = metric("distance driven", "M-8")
    duration_s: float | None = metric("simulated time", "M-8")
    fatal_per_100_km: float | None = metric("interventions per 100 km", "M-8")
    crashes_vehicle_per_100_km: float | None = metric("crashes with vehicles per 100 km", "R-6")
    serious_contacts_per_100_km: float | None = metric("serious contacts per 100 km", "T-4")
    road_departures_per_100_km: float | None = metric("departures per 100 km", "R-6")
    off_lanes_pct: float | None = metric("ticks off all lanes, less counted departures", "R-6")
    # the background
    traffic_contacts: int | None = metric("contacts among background vehicles", "R-5")
    traffic_contacts_after_ego: int | None = metric("those within 20 s of an ego contact", "R-5")
    traffic_put_back: int | None = metric("background vehicles stuck and put back", "M-7")
    traffic_moved: int | None = metric(
        "background vehicles moved from afar to near the ego", "A-209"
    )
    traffic_roll_overs: int | None = metric("background vehicles that rolled over", "T-11")
    traffic_km: float | None = metric("distance of all background vehicles", "R-5")
    traffic_contacts_per_100_km: float | None = metric("such contacts per 100 km", "R-5")
    # ticks
    samples: int | None = metric("ticks that count for perception", "A-250")
    skipped_supervised: int | None = metric("ticks under the supervisor", "A-250")
    skipped_no_report: int | None = metric("ticks on which the stack said nothing", "A-250")
    notices: int | None = metric("errors and remarks in the log", "A-192")


PIXELS = "pixels"  # folder of the runs that were driven on pixels too, below their campaign's
MATRIX = Columns(RunKey, Metrics, ("config", "weather", "seed", "profile", "sensors"))
MatrixEntry = Entry[RunKey, Metrics]
