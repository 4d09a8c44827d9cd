"""Every constant of a published formula matters: changed by 10 %, a marked test fails (M-14).

A mutant is a module constant with another value; its test runs in this process against it. All
constants here are read when they are used, so that patching them is enough.
"""

from __future__ import annotations

from importlib import import_module
from pathlib import Path

import pytest

from support.guards import STACK, Guard, interpret, module_of, run, survivors_of

TIERS, DETAILS = "stack/control/test_tiers.py", "stack/control/test_tier_details.py"
CAPS, FUSION = "stack/control/test_lateral_and_caps.py", "stack/perception/test_fusion.py"
CORRIDOR, RADAR = "stack/perception/test_corridor.py", "stack/perception/test_radar_lane.py"
MEMORY, SCAN = "stack/perception/test_persistence.py", "stack/perception/test_light_scan.py"
LAMP = "stack/perception/test_lamp_colour.py"


GUARDS = (
    Guard(
        "control.tiers",
        f"{TIERS}::test_first_tier_wins",
        "TOO_CLOSE HARD_STOP_ABOVE_KMH EMERGENCY_FULL_GAP EMERGENCY_SPAN "
        "LEAD_THROTTLE CRUISE_BRAKE_MAX LINE_THROTTLE HOLD_THROTTLE",
    ),
    Guard("control.tiers", f"{DETAILS}::test_time_gap", "V_GAP_MIN"),
    Guard("control.tiers", f"{DETAILS}::test_creeping_asks_the_cameras", "CREEP_KMH"),
    Guard("control.tiers", f"{DETAILS}::test_handbrake_below_3_km_h", "HANDBRAKE_BELOW_KMH"),
    Guard("control.tiers", f"{DETAILS}::test_emergency_begins_below_0_75_s", "EMERGENCY_GAP"),
    Guard(
        "control.tiers",
        f"{DETAILS}::test_hold_behind_a_car_or_at_the_line",
        "LEAD_LIGHT_RANGE STAND_OFF LEAD_HOLD",
    ),
    Guard(
        "control.tiers",
        f"{DETAILS}::test_approach_behind_a_car_brakes_by_the_excess_speed",
        "LEAD_DECELERATION LEAD_BRAKE_SPAN LEAD_BRAKE_MIN LEAD_THROTTLE",
    ),
    Guard("control.tiers", f"{DETAILS}::test_approach_is_never_slower_than_1_5_m_s", "LEAD_V_MIN"),
    Guard("control.tiers", f"{DETAILS}::test_range_of_following", "FOLLOW_GAP FOLLOW_DISTANCE"),
    Guard(
        "control.tiers",
        f"{TIERS}::test_zones",
        "TARGET_GAP HOLD_THROTTLE_OPENING HOLD_THROTTLE HOLD_BRAKE OPEN_THROTTLE "
        "OPEN_THROTTLE_MORE OPEN_SPAN CLOSE_BRAKE CLOSE_BRAKE_MORE CLOSE_SPAN",
    ),
    Guard("control.tiers", f"{DETAILS}::test_edges_of_the_zones", "DEAD_BAND HOLD_MARGIN"),
    Guard("control.tiers", f"{DETAILS}::test_edges_before_the_line", "LINE_HOLD LINE_NEAR"),
    Guard(
        "control.tiers",
        f"{DETAILS}::test_last_metres_before_the_line",
        "LINE_NEAR_DECELERATION LINE_NEAR_BRAKE LINE_NEAR_THROTTLE",
    ),
    Guard(
        "control.tiers",
        f"{DETAILS}::test_farther_from_the_line_the_speed_pid_brakes",
        "LINE_DECELERATION LINE_THROTTLE SPEED_GAINS",
    ),
    Guard(
        "control.tiers",
        f"{DETAILS}::test_proportional_law_before_the_line",
        "LINE_BRAKE_SPAN LINE_BRAKE_MIN",
    ),
    Guard("control.tiers", f"{DETAILS}::test_distance_pid_can_follow_instead", "DISTANCE_GAINS"),
    Guard("control.tiers", f"{TIERS}::test_coasts_twenty_ticks_after_following", "COAST_DURATION"),
    Guard(
        "control.tiers",
        f"{DETAILS}::test_coasting_brakes_a_little_above_15_km_h",
        "COAST_ABOVE_KMH COAST_BRAKE",
    ),
    Guard("control.pid", f"{TIERS}::test_pid_by_hand", "INTEGRAL_LIMIT"),
    Guard(
        "control.steering",
        f"{TIERS}::test_steering_by_hand",
        "LOOKAHEAD_PER_KMH LOOKAHEAD_MIN LOOKAHEAD_MAX GAIN_LOW_SPEED GAIN_FROM_KMH GAIN_SLOPE "
        "GAIN_MIN DAMPING",
    ),
    Guard("control.steering", f"{CAPS}::test_fixed_lookahead_is_12_m", "LOOKAHEAD_FIXED"),
    Guard("control.steering", f"{CAPS}::test_steer_is_zero_without_a_place_and_clipped",
          "TARGET_TOO_NEAR"),
    Guard(
        "control.steering",
        f"{CAPS}::test_smoothing_is_a_low_pass_with_a_rate_limit",
        "SMOOTHING_TIME SMOOTHING_RATE",
    ),
    Guard(
        "control.caps",
        f"{CAPS}::test_timer_counts_from_the_last_tick_at_a_stop",
        "STOPPED_BELOW_KMH",
    ),
    Guard("control.caps", f"{CAPS}::test_cap_ends_after_15_s_whatever_happens",
          "RESUME_DURATION"),
    Guard("control.caps", f"{CAPS}::test_caps_by_configuration", "RESUME_KMH"),
    Guard("control.caps", f"{CAPS}::test_spatial_cap_ends_behind_the_first_curve", "CURVE"),
    Guard("perception.lane_view", f"{CORRIDOR}::test_corrected_offset_is_the_offset_from_the_lane",
          "PARABOLA"),
    Guard("perception.lane_view", f"{CORRIDOR}::test_curvature_is_read_at_one_point_30_m_ahead",
          "REFERENCE_DISTANCE"),
    Guard(
        "perception.fusion",
        f"{CORRIDOR}::test_limits_of_both_tiers_as_printed",
        "BUMPER_ROWS BUMPER_MIN_VEHICLE BUMPER_HALF_WIDTH BUMPER_DEPTHS BUMPER_MIN_KEPT "
        "ROOF_ROWS ROOF_MIN_VEHICLE ROOF_DEPTHS ROOF_MIN_KEPT",
    ),
    Guard(
        "perception.fusion",
        f"{CORRIDOR}::test_roof_half_width_as_printed",
        "ROOF_HALF_WIDTH ROOF_WIDENING ROOF_HALF_WIDTH_MAX",
    ),
    Guard("perception.fusion", f"{FUSION}::test_a_tier_reads_the_tenth_percentile", "PERCENTILE"),
    Guard(
        "perception.fusion",
        f"{FUSION}::test_fused_distance",
        "BLEND_FROM BLEND_OVER BUMPER_ALONE_BELOW",
    ),
    Guard("perception.fusion", f"{FUSION}::test_median_of_five_samples", "MEDIAN_SAMPLES", (4, 6)),
    Guard(
        "perception.fusion",
        f"{FUSION}::test_rate_filter_starts_at_100_m_and_moves_12_m_per_tick",
        "NOTHING RATE_LIMIT",
    ),
    Guard("perception.fusion", f"{FUSION}::test_rate_filter_lasts_0_17_s", "RATE_WINDOW"),
    Guard(
        "perception.fusion",
        f"{FUSION}::test_verification_asks_for_vehicle_pixels_near_the_distance",
        "VERIFY_TOLERANCE",
    ),
    Guard("perception.radar", f"{RADAR}::test_the_stack_keeps_4_m_about_the_path", "HALF_WIDTH"),
    Guard(
        "perception.radar",
        f"{RADAR}::test_compatibility_corridor_is_1_6_m_and_asks_no_map",
        "PARABOLA_HALF_WIDTH",
    ),
    Guard("perception.radar", f"{RADAR}::test_keeps_0_1_to_80_m", "RANGES"),
    Guard("perception.radar", f"{RADAR}::test_keeps_altitudes_in_radians", "ALTITUDES"),
    Guard(
        "perception.radar",
        f"{RADAR}::test_velocity_limit_is_that_of_standing_objects",
        "VELOCITY_FLOOR VELOCITY_MARGIN FIRST_VELOCITY_LIMIT",
    ),
    Guard(
        "perception.radar",
        f"{RADAR}::test_standing_objects_stay_only_when_near",
        "ALWAYS_BELOW TRACKING_BELOW",
    ),
    Guard("perception.radar", f"{RADAR}::test_mount_is_2_m_ahead_of_the_origin", "MOUNT"),
    Guard(
        "perception.radar",
        f"{RADAR}::test_lane_reached_after_range_plus_10_m_is_the_same",
        "LOOK_BEYOND",
    ),
    Guard(
        "perception.persistence",
        f"{MEMORY}::test_durations_in_milliseconds",
        "CONFIRM_AFTER HOLD_SHORT HOLD_FOLLOWING HOLD_STOPPING FOLLOWING_FORGOTTEN SAFETY_HOLD",
    ),
    Guard(
        "perception.persistence",
        f"{MEMORY}::test_a_near_radar_target_needs_the_bumper",
        "RADAR_ALONE_ABOVE",
    ),
    Guard(
        "perception.persistence",
        f"{MEMORY}::test_safety_persist_holds_a_near_lead_for_5_s",
        "SAFETY_DISTANCE",
    ),
    Guard(
        "perception.persistence",
        f"{MEMORY}::test_last_distance_takes_any_detection_below_80_m",
        "VALID_BELOW",
    ),
    Guard(
        "perception.lights", f"{SCAN}::test_scan_distance_as_printed", "SCAN_MIN SCAN_TIME"
    ),
    Guard("perception.lights", f"{SCAN}::test_a_light_must_be_ahead", "COS_AHEAD"),
    Guard("perception.lights", f"{SCAN}::test_source_and_distance", "TRIGGER_BEFORE TRIGGER_BEHIND"),
    Guard(
        "perception.lights",
        f"{SCAN}::test_red_stops_green_does_not_and_yellow_only_with_room",
        "YELLOW_DECELERATION",
    ),
    Guard("perception.hsv", f"{LAMP}::test_only_the_upper_60_percent_count", "UPPER_ROWS"),
    # Colours below these limits do not reach OpenCV, so lower ones change nothing.
    Guard(
        "perception.hsv",
        f"{LAMP}::test_pale_and_dark_spots_are_no_lamps",
        "MIN_SATURATION MIN_VALUE",
        (88,),
    ),
    Guard(
        "perception.hsv",
        f"{LAMP}::test_hues",
        "YELLOW_HUES",
        (((22, 35),), ((20, 31),)),
    ),
    Guard(
        "perception.hsv",
        f"{LAMP}::test_hues",
        "RED_HUES",
        (((0, 8), (170, 180)), ((0, 10), (173, 180)), ((1, 10), (170, 180))),
    ),
    Guard(
        "perception.hsv", f"{LAMP}::test_area_and_aspect", "AREAS",
        ((3.3, 1000.0), (3.0, 900.0), (3.0, 1100.0)),
    ),
    Guard("perception.hsv", f"{LAMP}::test_area_and_aspect", "ASPECTS"),
)  # fmt: skip


CASES = [(g, constant) for g in GUARDS for constant in g.constants.split()]


@pytest.mark.slow
@pytest.mark.req("M-14")
@pytest.mark.parametrize(
    ("guard", "constant"), CASES, ids=[f"{g.module}.{constant}" for g, constant in CASES]
)
def test_a_changed_constant_is_noticed(guard, constant, monkeypatch):
    survivors = survivors_of(guard, constant, monkeypatch, STACK)
    assert not survivors, f"{constant}: {guard.test} accepts {survivors}"


# Functions whose results are scaled, each with a test that reaches them through their users.
FORMULAS = {
    "control.tiers.stopping_speed": f"{DETAILS}::test_last_metres_before_the_line",
    "control.steering.lookahead_distance": f"{CAPS}::test_centring_steers_by_the_chord_of_the_bend",
    "control.steering.steering_gain": f"{CAPS}::test_centring_steers_by_the_chord_of_the_bend",
    "control.steering.steer_command": f"{CAPS}::test_centring_steers_by_the_chord_of_the_bend",
    "road.angle_to": f"{CAPS}::test_fixed_lookahead_is_12_m",
    "perception.radar.velocity_limit": f"{RADAR}::test_velocity_limit_is_that_of_standing_objects",
    "perception.lights.scan_distance": f"{SCAN}::test_scan_distance_as_printed",
    "perception.lane_view.wrap_angle": f"{CORRIDOR}::test_curvature_is_read_at_one_point_30_m_ahead",
}


@pytest.mark.slow
@pytest.mark.req("M-14")
@pytest.mark.parametrize("factor", [0.9, 1.1])
@pytest.mark.parametrize("formula", FORMULAS)
def test_a_scaled_formula_is_noticed(formula, factor, monkeypatch):
    place, _, name = formula.rpartition(".")
    module = import_module(f"skidpad.stack.{place}")
    run(FORMULAS[formula])
    interpret(monkeypatch, [module_of(FORMULAS[formula].partition("::")[0])])
    run(FORMULAS[formula])  # without a change it passes in Python, too
    exact = getattr(module, name)
    monkeypatch.setattr(module, name, lambda *args: factor * exact(*args))
    with pytest.raises(AssertionError):
        run(FORMULAS[formula])


@pytest.mark.req("M-14")
def test_guards_are_marked_with_a_requirement():
    for guard in GUARDS:
        file, _, name = guard.test.partition("::")
        marks = [m for m in getattr(module_of(file), name).pytestmark if m.name == "req"]
        assert marks, guard.test


@pytest.mark.req("M-14")
@pytest.mark.parametrize("module", sorted({g.module for g in GUARDS}))
def test_every_number_of_a_module_has_a_guard(module):
    """But for what is ours, or a mere bound of a search."""
    bounds = {"LANE_STEP", "MAX_LANES", "MAX_SHIFTS", "WAYS", "NOWHERE"}
    bounds |= {"KEYS", "COASTED_FROM"}  # names of settings and of tiers
    bounds |= {"NOT_SEEN"}  # stands for no light state, which are 0 and more
    bounds |= {"EMERGENCY_BRAKE_MIN"}  # out of reach: tier 3 starts at 0.75 s (D-041)
    loaded = import_module(f"skidpad.stack.{module}")
    own = Path(loaded.__file__).read_text(encoding="utf-8")
    numbers = {
        name
        for name, value in vars(loaded).items()
        if name.isupper()
        and not name.startswith("_")
        and f"\n{name} = " in own
        and type(value) in (int, float, tuple)
    }
    guarded = {c for g, c in CASES if g.module == module}
    assert numbers - bounds - guarded == set()
