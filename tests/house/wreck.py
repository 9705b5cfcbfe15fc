"""Wrecks each held decision constant by itself and demands that a default test fails.

    python -m tests.house.wreck                      # all of them
    python -m tests.house.wreck grades LEAST_VIEWS   # those whose place holds one of the words

Each constant is made larger and smaller in turn; the tests named beside it must turn red both
times. Exit status 1 names what no test noticed. Where functions alone read a constant it is changed
in memory (`tests.house.in_place`), a third of a second on a quiet core; else, and where that went
unnoticed, a child process imports the file with another number in it. The tree is not touched.
"""

from __future__ import annotations

import argparse
import importlib
import os
import re
import sys
from dataclasses import dataclass
from importlib.machinery import SourceFileLoader
from pathlib import Path
from types import CodeType

from tests.house.in_place import can_be_in_place, in_child, noticed_in_place, pytest_main
from tests.places import ROOT

# By how much a constant is moved: a test on both sides of it, within a few percent, sees this.
LARGER, SMALLER = 1.25, 0.8


@dataclass(frozen=True, slots=True)
class Held:
    """Constants of one file, and the default tests that hold them on both sides.

    Attributes:
        file: from the repository's root.
        names: of the constants.
        tests: what pytest is given.
    """

    file: str
    names: tuple[str, ...]
    tests: str


EDGES = "tests/calib/tags/test_edge_pixels.py"
TAGS = "tests/calib/tags/test_tag_limits.py"
LOOK = "tests/vision/look/test_look_limits.py"
FUSE = "tests/vision/fuse/test_fuse_limits.py"
LAST_STEP = "test_one_step_is_enough_from_three_hundredths_of_a_blur"
ROBUST = "test_a_sighting_beyond_three_deviations_weighs_less"
RIG = "tests/vision/rig/test_rig_limits.py"
HOMING = "tests/homing/test_limits.py"
DECISION = "tests/ident/diagnose/test_decision_limits.py"
SPRINGS = "tests/ident/diagnose/test_springs.py"
RESIDUALS = "tests/ident/diagnose/test_residual_limits.py"
PLACES = "tests/ident/diagnose/lengths/test_lengths_limits.py"
INCLUSION = "tests/ident/diagnose/lengths/test_inclusion.py"
BENCH = "tests/ident/bench/test_bench_limits.py"
BENCH_DIAGNOSE = "tests/ident/bench/test_bench_diagnose.py"

DRIVE = "tests/ident/drive/test_drive_limits.py"
CHOICE = "tests/ident/drive/test_drive_decisions.py"
SEARCH = "tests/ident/drive/test_drive_search_limits.py"
LIKELIHOOD = "tests/ident/likelihood/test_likelihood_limits.py"
FILES = "tests/cdpr/files/test_file_limits.py"
SERVO = "tests/servo/test_servo_limits.py"
LAWS = "tests/servo/test_law_limits.py"

FIDIM = "tests/ident/fidim/test_fidim_limits.py"
MACHINE = "tests/freeswing/doctor/test_machine_limits.py"
SESSION = "tests/freeswing/session/test_session_limits.py"
MARKERS = "tests/freeswing/doctor/test_marker_limits.py"

SPOTS = "tests/cdpr/markers/test_marker_decisions.py"

PRIORS = "tests/ident/bench/test_bench_priors.py"
PLAN = "tests/excite/test_plan_limits.py"
FOOTAGE = "tests/calib/footage/test_footage_limits.py"
LENS = "tests/calib/camera/test_lens_limits.py"
BOARD = "tests/calib/board/test_board_limits.py"
SCENE = "tests/calib/scene/test_scene_limits.py"
MEASURED = "tests/cdpr/measured/test_measured_limits.py"
SIGNALS = "tests/ident/signals/test_limits.py"
BAND_LIMITS = "tests/ident/signals/test_band_limits.py"
UNTAGGED = "tests/vision/untagged/test_untagged_limits.py"
FEATURES = "tests/vision/untagged/test_feature_bias.py"
CDPR = "tests/cdpr/test_cdpr_limits.py"
START = "tests/vision/rig/test_start_limits.py"
RIG_START = "tests/calib/rig/test_rig_start_limits.py"
CALIB = "tests/calib/test_calib_limits.py"
PLANAR = "tests/vision/planar/test_planar_limits.py"

HELD = (
    Held("cdpr/markers/marker_jumps.py", ("JUMP_M", "JUMP_DEVIATIONS"), SPOTS),
    Held(
        "cdpr/markers/marker_units.py",
        ("UNIT_TOLERANCE", "SMALLEST_PLATFORM_M", "LARGEST_PLATFORM_M"),
        SPOTS,
    ),
    Held(
        "cdpr/markers/exchanged_labels.py",
        ("LABELS_FIT_M", "RENAMED_BETTER", "FEWEST_TO_EXCHANGE"),
        SPOTS,
    ),
    Held("cdpr/markers/spoiling_markers.py", ("SPOILS", "LEAST_SPOILT_M"), SPOTS),
    Held("cdpr/markers/slow_residuals.py", ("CHANCE",), SPOTS),
    Held("cdpr/markers/layouts_aligned.py", ("CLEAR", "DIFFERENT_M"), SPOTS),
    Held("cdpr/markers/undecided_marker.py", ("MOST_OPEN_M",), SPOTS),
    Held("ident/fidim/essential_parameters.py", ("WELL_IDENTIFIED_PERCENT", "NEAR_ZERO"), FIDIM),
    Held("ident/fidim/fidim.py", ("GOOD_COST",), FIDIM),
    Held("ident/fidim/total_least_squares.py", ("LEAST_GAP", "SMALLEST_RATIO"), FIDIM),
    Held("ident/judge/physical_consistency.py", ("_SIGNIFICANT", "LEAST_EXTENT_M"), FIDIM),
    Held("ident/fidim/slack_runs.py", ("REACH",), FIDIM),
    Held("ident/fidim/scatter.py", ("CORRELATED_S",), FIDIM),
    Held("ident/fidim/bias.py", ("SETTLED",), "tests/ident/fidim/test_scatter.py"),
    Held(
        "freeswing/doctor/markers.py",
        ("TARGET_OFF_M", "LARGE_JUMP_M", "LESS_TRUST", "LAYOUT_CHANGE_M"),
        MARKERS,
    ),
    Held("freeswing/doctor/machine.py", ("COMFORTABLE_GB",), MACHINE),
    Held("freeswing/doctor/cable_lengths.py", ("TURNED_CHANGE_M", "TURNED_BETTER",), MACHINE),
    Held("freeswing/session/drive_session.py", ("LARGEST_LATENCY_S", "SHORTEST_RUN"), SESSION),
    Held("freeswing/session/exchanged_lengths.py", ("NEXT_BEST",), SESSION),
    Held("vision/planar/axes_at_rest.py", ("STRAIGHT_RAD",), SESSION),
    Held("cdpr/simulation/parallel_wires.py", ("PARALLEL_RAD",), SESSION),
    Held("freeswing/session/new_recordings.py", ("VALIDATE_EVERY",), SESSION),
    Held("freeswing/session/repeated_runs.py", ("STRETCH", "SHARED"), MARKERS),
    Held("freeswing/results/comparison.py", ("NOTABLE_Z",), MARKERS),
    Held(
        "ident/drive/records/mistaken_records.py",
        (
            "JUMP", "WRONG_RATE", "MILLI", "UNLIKE_CURRENT", "LEAST_DEGREES", "MOST_DEGREES",
            "COUNTS", "ALIKE", "STRANGER", "LATENCY_S", "START_S", "START_COUNTS", "LEAST_MOTION",
            "ODD_ROW",
        ),
        DRIVE,
    ),
    Held(
        "ident/drive/diagnose/diagnose.py",
        ("REFITTED", "LEAST_BIC", "CONFOUNDED", "MOST_EFFECTS", "HALVED", "LEAD"),
        CHOICE,
    ),
    Held("ident/drive/records/mistaken_records.py", ("CLEAR",), SEARCH),
    Held("ident/drive/records/slack.py", ("SHORTEST_S", "LASTING_S", "MARGIN_S"), SEARCH),
    Held("ident/drive/records/ramps.py", ("MOVED_STEPS", "LEAST_ROWS"), SEARCH),
    Held("ident/drive/solver.py", ("MISFIT",), SEARCH),
    Held("ident/drive/diagnose/refit.py", ("LOST",), SEARCH),
    Held("ident/drive/unknowns.py", ("DYNAMIC_REACH", "KINEMATIC_REACH",), CHOICE),
    Held("ident/drive/trust.py", ("LARGEST_SHARE",), CHOICE),
    Held("ident/drive/trust.py", ("ABOVE_NOISE",), SEARCH),
    Held("ident/likelihood/calibration_modes.py", ("UNLIKELY",), LIKELIHOOD),
    Held("ident/signals/residual_colour.py", ("COLOURED", "LOW_BAND_HZ",), LIKELIHOOD),
    Held(
        "ident/likelihood/payload_runs.py",
        ("LEAST_SIGNIFICANCE", "OWN_INERTIA_STD_M2"),
        LIKELIHOOD,
    ),
    Held("ident/likelihood/between_runs.py", ("LEAST_RUNS",), LIKELIHOOD),
    Held(
        "ident/likelihood/samples_and_noise.py",
        (
            "UNIT_NOISE_M", "UNIT_NOISE_RAD", "UNSTATED_LENGTH_STD_M", "SMALLEST_LENGTH_STD_M",
            "LEAST_SAMPLES",
        ),
        LIKELIHOOD,
    ),
    Held("ident/likelihood/session_estimates.py", ("_ASTRAY",), LIKELIHOOD),
    Held("cdpr/files/unit_quaternions.py", ("RECORDED_OFF",), FILES),
    Held("cdpr/files/unit_quaternions.py", ("DECLARED_OFF",), MEASURED),
    Held("cdpr/files/trajectory_csv.py", ("WIDEST_SWING_RAD",), FILES),
    Held("cdpr/files/trajectory_trc.py", ("RATE_TOLERANCE",), FILES),
    Held("cdpr/files/mocap/fill_values.py", ("LEAST_FILL",), FILES),
    Held("cdpr/files/trajectory_c3d.py", ("SPARE_SHARE",), FILES),
    Held("cdpr/robot.py", ("LARGEST_FRAME_M",), FILES),
    Held("cdpr/files/drive_file.py", ("LARGEST_DRUM_M",), FILES),
    Held(
        "cdpr/files/robot_file.py", ("MOST_DRIVEN", "AXIS_TOLERANCE", "LARGEST_GRAVITY_M_S2"), FILES
    ),
    Held("servo/design/pid.py", ("BEYOND_MODES",), LAWS),
    Held("servo/design/lqg.py", ("FILTER_RATIO",), LAWS),
    Held("servo/design/pid.py", ("FILTER",), LAWS),
    Held("servo/loop/closed_loop.py", ("RATE_FILTER_S",), LAWS),
    Held("servo/loop/anti_windup.py", ("OUTPUT_NOISE",), LAWS),
    Held("servo/loop/trials.py", ("LATE_S",), LAWS),
    Held("servo/synthesis/gamma_search.py", ("BACK_OFF",), LAWS),
    Held("servo/tensions/robot_wrenches.py", ("OBJECTIVE_N",), LAWS),
    Held("servo/loop/judge.py", ("SETTLED_S",), SERVO),
    Held("servo/loop/held_or_lost.py", ("HELD_M", "HELD_RAD", "LOST_M"), SERVO),
    Held("servo/design/hinf.py", ("NOTHING",), SERVO),
    Held("servo/design/tuning.py", ("LEAST_MARGIN",), SERVO),
    Held("servo/files/identified_file.py", ("NEGATIVE",), SERVO),
    Held("servo/files/task_file.py", ("LAST_HOLD_S", "LARGEST_POSITION_M", "LONGEST_S"), SERVO),
    Held(
        "ident/likelihood/minimise.py",
        ("SHORTER", "MOST_RISES"),
        "tests/ident/likelihood/test_minimise.py",
    ),
    Held("cdpr/descent.py", ("BROKEN",), "tests/ident/likelihood/test_minimise.py"),
    Held(
        "calib/verdict/limits_of_use.py",
        (
            "LEAST_VIEWS", "GOOD_VIEWS", "LEAST_TILT_DEG", "GOOD_TILT_DEG", "LEAST_FILLED",
            "GOOD_FILLED", "WORST_FOCAL_STD", "GOOD_FOCAL_STD", "WORST_PX", "WORST_HELD_OUT",
            "GOOD_HELD_OUT", "WORST_LENGTH_BIAS", "GOOD_LENGTH_BIAS", "WORST_VOLUME_M",
            "GOOD_VOLUME_M", "WORST_DROPPED", "WORST_RIG_OVER_ALONE", "LEAST_ALONE_PX",
        ),
        "tests/calib/verdict/test_limits_of_use.py",
    ),
    Held(
        "freeswing/doctor/robot_file/units_and_places.py",
        (
            "LARGEST_PLATFORM_M", "LARGEST_PULLEY_M", "LEAST_GRAVITY_M_S2", "MOST_GRAVITY_M_S2",
            "SAME_POINT_M",
        ),
        "tests/freeswing/doctor/test_doctor.py",
    ),
    Held(
        "freeswing/doctor/robot_file/mass_and_inertia.py",
        ("LARGEST", "SMALLEST", "DENSEST", "DENSEST_PAYLOAD"),
        "tests/freeswing/doctor/test_mass_and_inertia.py",
    ),
    Held(
        "freeswing/doctor/run_samples.py",
        (
            "WORTHWHILE_WINDOW_S", "MOST_MISSING", "LONGEST_GAP_S", "FARTHEST_M",
            "FARTHEST_REACHES", "HARDLY_MOVES_M",
        ),
        "tests/freeswing/doctor/test_doctor.py",
    ),
    Held(
        "freeswing/doctor/cable_lengths.py",
        (
            "LENGTH_CHANGE_M",
        ),
        "tests/freeswing/doctor/test_doctor.py",
    ),
    Held(
        "freeswing/doctor/time_stamps.py",
        (
            "RATE_TOLERANCE", "ROUNDING_S", "LEAST_SAMPLES", "SKIPPED_STEPS", "RATE_CONTRADICTED",
            "LEAST_LOST",
        ),
        "tests/freeswing/doctor/test_doctor.py",
    ),
    Held(
        "freeswing/doctor/time_stamps.py",
        (
            "SINCE_1970_S",
        ),
        "tests/freeswing/hostile/test_sentences.py::test_a_machine_that_ran_for_long",
    ),
    Held(
        "freeswing/session/exchanged_lengths.py",
        ("LENGTH_DIFFERENCE_M", "BENCH_DIFFERENCE_M", "LEFT_OVER"),
        "tests/freeswing/session/test_exchanged_lengths.py",
    ),
    Held("ident/diagnose/search.py", ("MOST_ROUNDS",), "tests/ident/diagnose/test_search.py"),
    Held("ident/judge/likely_sizes.py", ("CHANCE",), "tests/ident/judge/test_likely_sizes.py"),
    Held(
        "ident/judge/missing_forces.py",
        ("FAR_FROM_WHITE",),
        "tests/ident/judge/test_missing_forces.py",
    ),
    Held(
        "ident/judge/wrong_geometry.py",
        ("LEAST_NOISE",),
        "tests/ident/judge/test_wrong_geometry.py::test_what_rounding_leaves_is_no_cause_s",
    ),
    Held("ident/judge/lawful_runs.py", ("AS_BAD",), "tests/ident/judge/test_lawful_runs.py"),
    Held(
        "ident/judge/far_samples.py", ("FAR", "MOST_FAR"), "tests/ident/judge/test_far_samples.py"
    ),
    Held(
        "calib/verdict/survey_check.py",
        ("SCALE_LIMIT", "TAG_LIMIT_M"),
        "tests/calib/verdict/test_survey_limits.py",
    ),
    Held(
        "calib/verdict/plumb_line.py",
        (
            "LEAST_LENGTH_STD", "WORST_SCATTER", "DEVIATIONS",
        ),
        "tests/calib/verdict/test_survey_limits.py",
    ),
    Held(
        "calib/verdict/colmap_check.py",
        ("MOST_DEVIATIONS", "LEAST_FOCAL"),
        "tests/calib/verdict/test_colmap_check.py::test_both_sides_of_what_is_let_pass",
    ),
    Held(
        "ident/judge/free_swing_law.py",
        (
            "LEAST_EXPLAINED", "LEAST_EXPLAINED_BY_NO_BODY", "WORST_ACCELERATION",
            "WORST_OF_NO_BODY",
        ),
        "tests/ident/judge/test_limits.py",
    ),
    Held(
        "ident/signals/window.py",
        ("REFERENCE_S", "FOLLOWS", "GROWN", "_MARGIN_S"),
        "tests/ident/signals/test_limits.py",
    ),
    Held(
        "ident/signals/constant_lengths.py",
        (
            "LENGTH_LIMIT_M",
        ),
        'tests/ident/signals/test_limits.py',
    ),
    Held("ident/signals/jumps.py", ("_ABOVE_NOISE", "_UNUSUAL"), SIGNALS),
    Held("ident/signals/derivatives.py", ("_LEAST_OUTPUTS",), SIGNALS),
    Held(
        "ident/diagnose/decision.py",
        (
            "REFITTED", "NEARLY_AS_GOOD", "LEAST_GAIN", "ACCEPTED",
            "MOST_WORSE", "NO_WORSE", "NO_WORSE_OF_GAIN", "LEAST_GAIN_LATER",
            "LEAST_EXCESS_LATER", "LEAST_PROMISE_LATER", "CONFOUNDED_DIFFERENCE",
            "LEAST_EXCESS", "RIVAL", "CLEARLY_LIKELIER", "CONTRADICTED", "LEAST_SHARE_EXPLAINED",
            "MOST_BELOW_NOISE",
        ),
        DECISION,
    ),
    Held(
        "ident/diagnose/own_values.py",
        ("SIZES_A_DECADE", "SMALLEST_SIZE"),
        "tests/ident/diagnose/test_own_values.py",
    ),
    Held(
        "ident/diagnose/decision.py",
        ("LARGEST_EXCESS_LEFT",),
        "tests/ident/diagnose/test_search.py",
    ),
    Held("ident/diagnose/sets/fits_as_rivals.py", ("INERTIA_RANGE",), RESIDUALS),
    Held("ident/diagnose/backward_removal.py", ("LARGEST_RISE",), RESIDUALS),
    Held(
        "ident/diagnose/spectrum.py",
        (
            "LOWEST_HZ", "LINES", "HANN_WIDTH", "SMALLEST_RESIDUAL_M", "SMALLEST_RESIDUAL_RAD",
        ),
        RESIDUALS,
    ),
    Held("ident/diagnose/lengths/stated_lengths.py", ("LENGTHS_BY_CHANCE",), PLACES),
    Held(
        "ident/diagnose/model_probabilities.py",
        ("CHANCE_OF_EFFECT",),
        "tests/ident/diagnose/test_model_probabilities.py",
    ),
    Held(
        "ident/diagnose/lengths/place_probabilities.py",
        ("CHANCE_OF_WRONG", "MOST_RIVALS", "COUNTS"),
        PLACES,
    ),
    Held(
        "ident/diagnose/lengths/length_rows.py",
        ("LEAST_SIZE", "LEAST_SIZE_UNSTATED"),
        PLACES,
    ),
    Held("ident/diagnose/lengths/place_probabilities.py", ("ACCEPTED", "RIVAL"), INCLUSION),
    Held(
        "ident/diagnose/lengths/equilibria.py",
        ("CONTRADICTED",),
        "tests/ident/diagnose/lengths/test_equilibria.py",
    ),
    Held("ident/diagnose/lengths/wrong_places.py", ("LESS_TRUST",), INCLUSION),
    Held(
        "ident/diagnose/lengths/joint_lengths.py",
        ("WORSE",),
        "tests/ident/diagnose/lengths/test_joint_lengths.py",
    ),
    Held(
        "ident/likelihood/between_runs.py",
        ("CHANCE",),
        "tests/ident/likelihood/test_between_runs.py",
    ),
    Held(
        "cdpr/markers/contradicting_samples.py",
        ("STANDS_OUT_M",),
        "tests/cdpr/markers/test_contradicting_samples.py",
    ),
    Held(
        "ident/diagnose/unexplained.py",
        ("LEAST_EXCESS", "LEAST_COLOUR", "LEAST_HINT_GAIN"),
        DECISION,
    ),
    Held(
        "ident/diagnose/answer/unmet_validation.py",
        ("MOST_OVER_NOISE",),
        "tests/ident/diagnose/answer/test_unmet_validation.py",
    ),
    Held(
        "ident/diagnose/answer/still_missing.py",
        ("AS_DECLARED",),
        "tests/ident/diagnose/answer/test_still_missing.py",
    ),
    Held(
        "ident/diagnose/answer/unseen_vibration.py",
        ("SAME_STRETCH",),
        "tests/ident/diagnose/answer/test_unseen_vibration.py",
    ),
    Held("ident/diagnose/outstanding_runs.py", ("OUTSTANDING",), DECISION),
    Held("ident/diagnose/refit.py", ("REWEIGHED",), DECISION),
    Held("ident/diagnose/springs/full_motion.py", ("PLUCKED_MORE", "MORE_LIKELY"), SPRINGS),
    Held(
        "ident/diagnose/declared_model.py",
        ("LEAST_RUNS", "SMALL_BESIDE_SWINGS", "AT_THE_NOISE"),
        DECISION,
    ),
    Held(
        "cdpr/measured/held_doubled_wild.py",
        (
            "FEWEST_HELD", "ABOVE_RESOLUTION", "DOUBLED_SHARE", "LONGEST_DOUBLE",
            "WILD_DEVIATIONS", "HALF_WITHIN", "STEP_DEVIATIONS", "BACK_WITHIN",
            "LONGEST_WILD_S", "LONGEST_STEP_S",
        ),
        "tests/cdpr/measured/test_held_doubled_wild.py",
    ),
    Held(
        "cdpr/measured/lost_rows.py",
        ("CLEAR_STEPS", "TO_WITHIN", "EVEN", "LEAST_SAMPLES"),
        "tests/cdpr/measured/test_lost_rows.py",
    ),
    Held(
        "cdpr/measured/repeated_and_interpolated.py",
        ("MOST_BY_CHANCE", "ON_THE_LINE", "INTERPOLATED_SHARE", "LEAST_SAMPLES", "PATTERN_SHARE"),
        "tests/cdpr/measured/test_repeated_and_interpolated.py",
    ),
    Held("ident/bench/fit_rounds.py", ("LEAST_FOR_SCATTER",), BENCH),
    Held(
        "ident/bench/fit_rounds.py",
        ("FIRST_S", "LONGER", "FEW"),
        "tests/ident/bench/test_first_seconds.py",
    ),
    Held(
        "freeswing/doctor/bench_units.py",
        (
            "LONGEST", "SHORTEST", "FARTHEST", "HEAVIEST", "LIGHTEST", "WIDEST", "SLOWEST",
            "FEWEST", "LOOSEST", "BENEATH",
        ),
        "tests/freeswing/doctor/test_bench_units.py",
    ),
    Held(
        "ident/bench/mass_verdict.py",
        ("CONTRADICTED", "STRAINED", "CHECKING", "GIVES_WAY", "LEFT_OFF_THE_SCALE"),
        BENCH,
    ),
    Held("ident/bench/noise.py", ("BAND", "LEAST_SHARE",), BENCH),
    Held("ident/bench/scatter_between_runs.py", ("SIGNIFICANT",), BENCH),
    Held("ident/bench/told/classic_formula.py", ("LEAST_PERIODS", "LEANING_PERCENT"), BENCH),
    Held("ident/bench/told/report_objects.py", ("RESTS_ON_PRIOR", "TELLS_NOTHING"), BENCH),
    Held(
        "ident/bench/told/contradicted.py",
        ("WORTH_WEIGHING",),
        "tests/ident/bench/test_contradicted.py",
    ),
    Held("ident/bench/told/rolled.py", ("ROLLED_RAD",), "tests/ident/bench/test_rolled.py"),
    Held(
        "ident/bench/two_wires/free_roll.py",
        ("MIDDLE_MOMENT", "WIDE_MOMENT", "LEAST_MOMENT", "ASIDE"),
        "tests/ident/bench/two_wires/test_free_roll.py",
    ),
    Held("ident/bench/channels.py", ("LEAST_OVER_NOISE",), BENCH),
    Held("ident/bench/runs.py", ("STILL",), BENCH),
    Held("ident/bench/diagnose/taken_for_granted.py", ("SURE",), BENCH_DIAGNOSE),
    Held("ident/bench/diagnose/document.py", ("LIKELY",), BENCH_DIAGNOSE),
    Held("ident/bench/diagnose/diagnose.py", ("LEAST_RUNS",), BENCH_DIAGNOSE),
    Held("ident/bench/noise.py", ("COLOURED", "SLOWEST_PARTS"), BENCH_DIAGNOSE),
    Held(
        "ident/signals/usable_runs.py",
        ("LARGEST_AMPLIFICATION", "LEAST_SIGNAL"),
        "tests/ident/signals/test_limits.py",
    ),
    Held(
        "vision/look/marker_blobs.py",
        (
            "_MARGIN", "_NEAR_PX", "_LEAST_PIXELS", "_MOST_SIDE_PX", "_LEAST_CONTRAST",
            "_LEAST_FILL", "_LEAST_ASPECT",
        ),
        LOOK,
    ),
    Held(
        "vision/look/marker_names.py",
        ("_GATE_M", "_CLEAR", "_MATCH_M", "_RAYS_MEET_M", "_FORGET", "_START_EVERY"),
        LOOK,
    ),
    Held("vision/planar/film_faults.py", ("SIZE_OFF",), PLANAR),
    Held("vision/look/marker_pose.py", ("MOST_SPOTS", "_NEAR_M", "_EXACT_M", "_CLEAR"), LOOK),
    Held("vision/look/occlusion.py", ("_RIM_CELLS", "_READ_CELLS", "_LEAST_HEIGHT"), LOOK),
    Held(
        "vision/look/target_check.py",
        ("WRONG_SHARE", "_FITS_SHARE", "_LEAST_FRAMES", "_SAME_SIZE"),
        LOOK,
    ),
    Held(
        "vision/look/follow.py",
        (
            "_BASE_EVERY", "_SEARCH_EVERY", "_EAGER_SEARCHES", "_FACING",
        ),
        LOOK,
    ),
    Held("vision/look/lighting.py", ("_DARK_SPREAD", "_SATURATED", "_BRIGHT_SHARE"), LOOK),
    Held("calib/tags/edge_pixels.py", ("LEAST_CELL",), EDGES),
    Held("calib/tags/pattern_fit.py", ("EDGE_SETTLED",), f"{EDGES}::{LAST_STEP}"),
    Held("calib/tags/pattern_fit.py", ("MOST_BLUR",), f"{TAGS}::test_blur_up_to_six_pixels"),
    Held(
        "calib/tags/pattern_fit.py",
        ("LEAST_ERROR",),
        f"{TAGS}::test_print_is_as_even_as_a_fiftieth_of_its_contrast",
    ),
    Held(
        "calib/tags/pattern_fit.py",
        ("OUTLYING", "COVERED_SETTLED", "COVERED_SCALE"),
        f"{TAGS}::test_a_tag_that_is_covered_in_part_has_to_settle",
    ),
    Held(
        "calib/tags/accept_tag.py",
        ("_LEAST_EXPLAINED",),
        f"{TAGS}::test_a_pattern_that_explains_three_quarters",
    ),
    Held(
        "calib/tags/accept_tag.py",
        ("_LEAST_CONTRAST",),
        f"{TAGS}::test_print_that_stands_out_by_eight_grey_levels",
    ),
    Held(
        "calib/tags/accept_tag.py",
        ("_CROWDED_CELLS", "_CROWDED_PX"),
        f"{TAGS}::test_crowded_cells_count_as_less_certain",
    ),
    Held("calib/tags/accept_tag.py", ("_TOO_CROWDED",), f"{TAGS}::test_cells_that_blend"),
    Held(
        "calib/tags/base_tags.py",
        ("SURVEY_STD_M",),
        f"{TAGS}::test_corners_of_many_stills_and_their_survey",
    ),
    Held(
        "calib/tags/base_tags.py",
        ("_SAME_PLACE_PX",),
        f"{TAGS}::test_a_surveyed_tag_that_moved",
    ),
    Held("vision/fuse/pose_kernels.py", ("ROBUST_LIMIT",), f"{FUSE}::{ROBUST}"),
    Held("vision/fuse/tag_layout.py", ("_REJECT",), FUSE),
    Held("vision/look/detect.py", ("_LEAST_PERIMETER_RATE",), LOOK),
    Held("vision/look/marker_blobs.py", ("_EDGE_LEVEL", "_CENTRE_FLOOR_PX"), LOOK),
    Held("calib/camera/impossible_lenses.py", ("SHORTEST_FOCAL", "LONGEST_FOCAL",), BOARD),
    Held(
        "calib/scene/scene_verdict.py",
        ("LEAST_POINTS", "GOOD_POINTS"),
        "tests/calib/scene/test_scene_decisions.py::test_few_points_warn_and_very_few_refuse",
    ),
    Held("cdpr/measured/held_doubled_wild.py", ("LEAST_STEP_M", "LEAST_STEP_RAD"), MEASURED),
    Held("cdpr/mesh/nominal_inertia.py", ("DOUBTED_STATED", "DOUBTED_UNSTATED"), CDPR),
    Held(
        "ident/diagnose/lengths/length_rows.py", ("DRIFT_M", "DRIFT_RAD", "RUN_OUT_M"), PLACES
    ),
    Held("ident/diagnose/lengths/equilibria.py", ("COM_M", "FORCE_M_S2"), PLACES),
    Held("vision/rig/lag_search.py", ("_PLAUSIBLE", "_PLAUSIBLE_M"), START),
    Held("servo/files/task_file.py", ("POSITION_STD_M", "ANGLE_STD_RAD"), SERVO),
    Held("vision/fuse/corner_noise.py", ("LEAST_FLOOR_PX",), FUSE),
    Held("vision/fuse/rejected_sightings.py", ("_REJECT",), FUSE),
    Held("vision/fuse/calibration_share.py", ("_LEFT_OUT",), FUSE),
    Held("vision/fuse/tag_growth.py", ("USUAL_PX",), "tests/vision/fuse/test_tag_growth.py"),
    Held(
        "vision/fuse/corner_noise.py",
        ("ALIKE", "SURE_SIGMAS"),
        "tests/vision/fuse/test_corner_noise.py",
    ),
    Held(
        "vision/fuse/motion/motion_spectrum.py",
        ("HIGHEST", "AS_LARGE"),
        "tests/vision/fuse/motion/test_motion_from_poses.py",
    ),
    Held(
        "vision/rig/gross_faults.py",
        (
            "MOST_TURN_RAD", "MOST_SHIFT_M", "MOST_APART_M", "MOST_FLOOR_PX", "MOST_REJECTED",
            "_SAME_TURN_RAD", "_SAME_SIZE",
        ),
        RIG,
    ),
    Held(
        "vision/rig/lag_search.py",
        ("MOST_LAG_S", "LEAST_OVERLAP_S", "OVERLAP_SHARE", "_NEARLY_BEST"),
        RIG,
    ),
    Held("vision/rig/kept_clocks.py", ("MOST_APART_S",), RIG),
    Held("vision/recorded_alone.py", ("LEAST_BY_TWO",), "tests/vision/footage/test_alone.py"),
    Held("vision/rig/untied_cameras.py", ("KNOCKED_PX", "SURE_SIGMAS"), RIG),
    Held("vision/rig/lag_accepted.py", ("IN_EARNEST",), RIG),
    Held(
        "calib/rig/survey_noise.py",
        (
            "_SURVEY_PRIOR", "LEAST_SURVEY_STD_M",
        ),
        "tests/calib/rig/test_rejections.py",
    ),
    Held(
        "calib/rig/line_times.py",
        (
            "LINE_TIME_SIGMAS", "LEAST_READOUT_S",
        ),
        "tests/calib/rig/test_rejections.py",
    ),
    Held(
        "calib/rig/board_sag_and_growth.py",
        (
            "SAG_STD", "GROWTH_STD",
        ),
        "tests/calib/rig/test_rejections.py",
    ),
    Held(
        "calib/rig/outliers.py",
        (
            "VIEW_OUTLIER_SIGMAS", "VIEW_OUTLIER_FLOOR_PX", "CORNER_SIGMAS",
        ),
        "tests/calib/rig/test_rejections.py",
    ),
    Held(
        "calib/rig/coarse_clocks.py",
        (
            "MOST_OFFSET_S", "LEAST_OVERLAP", "LEAST_CORRELATION", "LEAST_SPEED_PX_S",
            "LEAST_MOVING", "_MOST_GAP", "LEAST_SIGMAS", "CLEAR_SIGMAS",
        ),
        "tests/calib/rig/test_rejections.py",
    ),
    Held(
        "calib/board/chessboard_corners.py",
        ("MOST_HARD", "LEAST_ALIKE"),
        "tests/calib/board/test_plain_boards.py",
    ),
    Held(
        "calib/verdict/halves_and_lengths.py",
        ("CHANCE",),
        "tests/calib/verdict/test_limits_of_use.py",
    ),
    Held("calib/rig/triangulation.py", ("_LEAST_ANGLE_RAD",), "tests/calib/rig/test_rejections.py"),
    Held("homing/misfit.py", ("GOOD_FIT", "DOUBTFUL_FIT", "FAR_OFF"), HOMING),
    Held("homing/guess_from_tensions.py", ("_WEIGHTS_OF_A_GUESS",), HOMING),
    Held("homing/simulated_acquisition.py", ("_SLACK_PULL",), HOMING),
    Held("homing/reading_mistakes.py", ("SUSPECT_WEIGHT",), HOMING),
    Held("homing/fit_start_pose.py", ("LOSS_LIMIT",), HOMING),
    Held(
        "homing/swivel_advice.py",
        ("_SMALLEST_ARM_RADII", "_SMALLEST_ARM_SHARE", "_WORTHWHILE"),
        HOMING,
    ),
    Held("vision/rig/real_effects.py", ("SIGMAS",), RIG),
    Held(
        "vision/rig/real_effects.py",
        (
            "LEAST_CLOCK_S", "LEAST_LINE_S",
        ),
        'tests/vision/rig/test_rig_limits.py',
    ),
    Held("vision/rig/moved_cameras.py", ("MOVED_PX",), 'tests/vision/rig/test_rig_limits.py'),
    Held(
        "freeswing/doctor/run_roles.py",
        ("FEWEST_IDENTIFY",),
        "tests/freeswing/doctor/test_doctor.py",
    ),
    Held(
        "servo/files/wrench_file.py",
        ("MOST_MOMENT", "MILLIMETRES"),
        "tests/freeswing/commands/test_control.py::test_wrong_wrenches_are_refused_by_line "
        "tests/freeswing/commands/test_control.py::test_places_and_moments_that_may_be_meant_are_no_units",
    ),
    Held(
        "servo/design/robustness.py",
        ("FAILING", "WORTH"),
        "tests/servo/design/test_robustness.py::test_failing_has_two_sides",
    ),
    Held(
        "servo/design/drawn_robots.py",
        ("LEAST_SHARE",),
        "tests/servo/design/test_robustness.py::test_wide_draws_stay_robots",
    ),
    Held(
        "ident/bench/priors/wire_priors.py",
        (
            "UNSTATED_LENGTH_STD_M", "EACH_LENGTH", "WRONG_LENGTH",
        ),
        PRIORS,
    ),
    Held(
        "ident/bench/priors/motion_priors.py",
        (
            "TWICE_AS_WIDE", "CREEPS", "SWAY_RAD", "UNSEEN_RAD", "SEEN_RAD",
        ),
        PRIORS,
    ),
    Held(
        "ident/bench/priors/body_priors.py",
        (
            "WIDE_COM", "UPRIGHT", "CENTRED_COM", "WIDE_TENSOR", "WIDE_PRODUCTS", "WIDE_MASS",
        ),
        PRIORS,
    ),
    Held(
        "ident/bench/priors/channel_priors.py",
        ("BENT", "TWICE_BENT", "UNKNOWN_GAIN", "OWN_LEVER", "OFFSET",),
        PRIORS,
    ),
    Held("ident/bench/channels.py", ("HIGHEST_ORDER",), PRIORS),
    Held("ident/bench/first_guesses.py", ("LEANS_RAD",), PRIORS),
    Held("ident/bench/priors/wire_priors.py", ("FROM_POSES_STD_M",), PRIORS),
    Held("ident/bench/scatter_between_runs.py", ("WIDE_SCATTER",), PRIORS),
    Held("excite/bench_plan.py", ("ENOUGH",), PLAN),
    Held("excite/bench_table.py", ("LEAST",), PLAN),
    Held("excite/bench_plan.py", ("HOOP", "SMALL",), PLAN),
    Held("excite/plan_tables.py", ("_GOOD_COST",), PLAN),
    Held("ident/drive/elastic_search.py", ("FIRST_HEAD_S", "HEAD_STEPS",), SEARCH),
    Held("ident/drive/second_start.py", ("SECOND_START",), SEARCH),
    Held("ident/drive/predicted_run.py", ("HEAD_S", "ELASTIC_STEPS"), SEARCH),
    Held("ident/drive/added_effects.py", ("SAME",), SEARCH),
    Held("ident/drive/plan/plan_poses.py", ("STATIC_SAMPLES",), SEARCH),
    Held("ident/drive/plan/plan_poses.py", ("MOST_TOGETHER",), SEARCH),
    Held("calib/footage/first_frames.py", ("_ENOUGH_MOVING",), FOOTAGE),
    Held(
        "calib/footage/copied_frames.py",
        (
            "COPY_SHARE", "COPY_SHIFT_PX", "_EDGE_GREY", "_LEAST_GREY",
        ),
        FOOTAGE,
    ),
    Held("calib/footage/interlacing.py", ("_MOVED_GREY", "_LEAST_MOVED", "COMB_RATIO"), FOOTAGE),
    Held("calib/footage/frame_times.py", ("SAME_RATE", "NEAR_RATE", "_PLAYED_SLOWLY",), FOOTAGE),
    Held("calib/footage/container_times.py", ("_TICK_SHARE", "_LONGEST_TICK",), FOOTAGE),
    Held("calib/camera/lens_choice.py", ("LEAST_VIEWS", "_SIGMAS", "_LEAST_GAIN",), LENS),
    Held("calib/camera/intrinsics.py", ("LEAST_VIEWS", "_GOOD_PX"), LENS),
    Held(
        "calib/camera/off_plane_views.py",
        (
            "FLATNESS_LIMIT", "_FLATNESS_OUTLIER", "_FLATNESS_FLOOR",
        ),
        LENS,
    ),
    Held("calib/board/board_unlike_seen.py", ("FLAT", "_LEAST_VIEWS", "_MARKER_OFF",), BOARD),
    Held("calib/board/declared_board.py", ("LARGEST_SQUARE_M",), BOARD),
    Held("calib/board/chessboard_corners.py", ("_LOOKED_FOR_OTHERS", "_SMALLEST",), BOARD),
    Held("calib/board/circle_grid_corners.py", ("_LEAST_AREA_PX2", "_LEAST_CONTRAST",), BOARD),
    Held(
        "calib/board/board_corners.py",
        ("LEAST_CORNERS", "_LEAST_EXPLAINED", "LEAST_STD_PX",),
        BOARD,
    ),
    Held("calib/board/platform_as_board.py", ("LEAST_TAGS",), BOARD),
    Held("calib/camera/impossible_lenses.py", ("HALFWAY", "LEAST_SEEN",), BOARD),
    Held("calib/scene/frame_by_survey.py", ("LEAST_BREADTH",), SCENE),
    Held("calib/scene/scale_by_distances.py", ("DISTANCE_SIGMAS",), SCENE),
    Held("calib/scene/clicked_points.py", ("CLICK_STD_PX",), SCENE),
    Held("calib/scene/chosen_points.py", ("MATCH_SIGMAS", "LEAST_SIGHTINGS"), SCENE),
    Held("calib/scene/blob_sizes.py", ("LEAST_SIZE_PX",), SCENE),
    Held("calib/scene/blob_sizes.py", ("OBLIQUE_BLOB_PX",), SCENE),
    Held("calib/scene/tape_measured.py", ("TAPE_STD_M",), SCENE),
    Held("calib/scene/stills.py", ("LEAST_IMAGES", "_AT_REST_GREY",), SCENE),
    Held("vision/untagged/feature_matches.py", ("RATIO", "MOST_ANGLE_COS",), UNTAGGED),
    Held(
        "vision/untagged/pose_by_matches.py",
        ("LEAST_MATCHES", "INLIER_PX"),
        UNTAGGED,
    ),
    Held("vision/untagged/adjusted_points.py", ("_FAR",), UNTAGGED),
    Held("vision/untagged/feature_bias.py", ("LEAST_FRAMES",), FEATURES),
    Held(
        "vision/untagged/aligned_patches.py",
        ("FARTHEST_PX", "LEAST_LIKENESS", "LEAST_FACING"),
        "tests/vision/untagged/test_aligned_patches.py",
    ),
    Held(
        "vision/untagged/rest_model.py",
        (
            "CHANGED_GREY", "CHANGED_SHARE", "WORST_PX", "LEAST_POINTS",
        ),
        UNTAGGED,
    ),
    Held("vision/untagged/named_points.py", ("WORST_NAMED_M", "CLICK_STD_PX"), UNTAGGED),
    Held(
        "cdpr/measured/target.py",
        (
            "SMALLEST_M", "LARGEST_TAG_M", "LARGEST_MARKER_M",
            "LEAST_BREADTH",
        ),
        MEASURED,
    ),
    Held("cdpr/measured/rigid_fit.py", ("LEAST_SPREAD",), MEASURED),
    Held("cdpr/measured/recording_to_base_frame.py", ("MOST_MISFIT_M",), MEASURED),
    Held(
        "calib/footage/copied_frames.py",
        ("MOST_COPIES",),
        "tests/freeswing/doctor/test_recording_limits.py",
    ),
    Held(
        "ident/signals/band.py",
        ("LOWEST_PASS_HZ", "HIGHEST_SHARE", "_LEAST_SAMPLES", "_CAUTION", "_FLOOR_FROM", "_CLEAR"),
        BAND_LIMITS,
    ),
    Held("ident/judge/prediction.py", ("_ASTRAY", "PREDICTED_HZ"), BAND_LIMITS),
    Held("cdpr/driven/drive.py", ("LEAST_DRIVEN",), CDPR),
    Held("cdpr/effects/forces/tether.py", ("DEPTH",), CDPR),
    Held("cdpr/effects/forces/tether.py", ("LESS_AT_REST",), "tests/ident/diagnose/test_refit.py"),
    Held("cdpr/files/drive_file.py", ("COULOMB_WIDTH_RAD_S",), CDPR),
    Held("cdpr/mesh/nominal_inertia.py", ("LARGEST_PLATFORM_M",), CDPR),
    Held("cdpr/mesh/separate_bodies.py", ("_INSIDE",), CDPR),
    Held("cdpr/model/undefined_poses.py", ("LEAST_COSINE",), CDPR),
    Held("cdpr/simulation/simplified_newton.py", ("LARGEST_RATIO",), CDPR),
    Held("cdpr/markers/layouts_aligned.py", ("FREEDOM",), SPOTS),
    Held("cdpr/markers/layout_of_session.py", ("RUN_STD_M",), SPOTS),
    Held(
        "cdpr/markers/layout_against_target.py",
        (
            "TARGET_LEAST_STD_M", "WRONG_BY_M", "WRONG_SHARE", "TARGET_CLEAR",
        ),
        SPOTS,
    ),
    Held("cdpr/markers/spoiling_markers.py", ("LEAST_VARIANCE_SHARE",), SPOTS),
    Held("cdpr/markers/session_markers.py", ("FEWEST_SAMPLES",), SPOTS),
    Held(
        "cdpr/measured/quaternion_readings.py",
        ("LEFT_OVER",),
        "tests/freeswing/doctor/test_recordings_against_lengths.py::test_what_is_left_by_the_right_reading",
    ),
    Held(
        "freeswing/doctor/robot_file/mistaken_cables.py",
        ("LEAST_CHANGE", "LEFT_OVER", "LEAST_RUNS", "LEAST_MEANS"),
        "tests/freeswing/doctor/robot_file/test_mistaken_cables.py",
    ),
    Held(
        "freeswing/doctor/recordings_against_lengths.py",
        ("LENGTHS_OFF_M", "LEFT_BY_A_SLIP"),
        "tests/freeswing/doctor/test_recordings_against_lengths.py",
    ),
    Held(
        "vision/rig/lag_accepted.py",
        ("REACH_FRAMES", "SURE_SIGMAS", "_LEAST_COMPARED", "_SAME_START_S"),
        START,
    ),
    Held("vision/look/tied_tags.py", ("SAME_PLACE_M",), "tests/vision/look/test_tied_tags.py"),
    Held("vision/rig/correct_rig.py", ("_LEAST_KNOWN",), START),
    Held("vision/rig/lag_search.py", ("_LEAST_OVERLAP",), START),
    Held("vision/rig/rig_step.py", ("_KEEP_SCORE", "STRETCH_S", "LEAST_PARTS"), START),
    Held(
        "vision/rig/gross_faults.py",
        ("MOST_CONTRADICTING",),
        "tests/vision/rig/lost/test_lost_frames.py::test_frames_on_end_that_contradict",
    ),
    Held(
        "vision/rig/lost/lost_frames.py",
        (
            "LEAST_FRAMES", "REGULAR", "MOSTLY", "SURE", "MOST_LOST", "_MOST_TWICE",
            "_MOST_BESIDE", "_LEAST_CLUSTER", "_MOST_CLUSTER",
        ),
        "tests/vision/rig/lost/test_lost_frames.py",
    ),
    Held(
        "vision/rig/lost/usual_stretches.py",
        ("STRAINED", "AROUND", "FITS", "LEAST_STRETCHES", "_MOST_STRETCHES"),
        "tests/vision/rig/lost/test_lost_frames.py",
    ),
    Held("vision/rig/lost/kinks.py", ("MEETS",), "tests/vision/rig/lost/test_lost_frames.py"),
    Held(
        "vision/rig/stamp_jitter.py",
        ("LEAST_JITTER_S", "_LEAST_FRAMES", "_FLOOR_PX", "_SURE_SIGMAS"),
        START,
    ),
    Held("vision/rig/clock_rates.py", ("MOST_APART",), "tests/vision/rig/test_clock_rates.py"),
    Held(
        "vision/rig/shared_jitter.py",
        ("FASTEST", "FAST", "_LEAST_POSES", "_SURE_SIGMAS", "_BEYOND"),
        "tests/vision/rig/test_shared_jitter.py",
    ),
    Held("vision/rig/untied_cameras.py", ("_LEAST_TAGS", "_LEAST_KNOWN"), START),
    Held("calib/rig/bundle_adjustment.py", ("_COMMON_FREEDOM", "_LEAST_FREEDOM"), RIG_START),
    Held("calib/rig/tie_by_shared_boards.py", ("LEAST_SHARED", "_CAP_PX"), RIG_START),
    Held("calib/rig/outliers.py", ("LEAST_CORNERS",), RIG_START),
    Held("calib/rig/tie_by_swings.py", ("_MOST_MISS_PX", "MOST_RUNS"), RIG_START),
    Held("calib/board/coverage.py", ("GRID",), CALIB),
    Held("calib/board/searched_frames.py", ("BURST",), CALIB),
    Held("calib/board/motion_cuts.py", ("LEAST_FLOW", "_LARGEST_BEND",), CALIB),
    Held(
        "cdpr/files/mocap/text_exports.py",
        ("RATE_TOLERANCE", "PRINTED_S"),
        "tests/cdpr/files/test_mocap_contradictions.py",
    ),
    Held("calib/exchange/impossible_cameras.py", ("RIGID",), CALIB),
    Held("calib/exchange/metres_or_millimetres.py", ("FARTHEST_M",), CALIB),
    Held(
        "calib/exchange/matrix_and_distortion.py",
        ("_SKEW",),
        "tests/calib/exchange/test_files_by_hand.py",
    ),
    Held("calib/exchange/qualisys.py", ("_NEAR_MIDDLE",), CALIB),
    Held("calib/verdict/plumb_line.py", ("WORST_STD_RAD",), CALIB),
    Held("calib/verdict/plumb_line_file.py", ("CLICK_STD_PX",), CALIB),
    Held("calib/verdict/survey_check.py", ("MIRRORED", "LEAST_TRIANGULATED"), CALIB),
    Held("calib/verdict/halves_and_lengths.py", ("LEAST_HALF",), CALIB),
    Held(
        "vision/planar/dots.py",
        ("REACH", "LEAST_REACH", "LONGEST_GAP", "LEAST_SHARE", "MIRRORED"),
        PLANAR,
    ),
    Held(
        "vision/planar/film_faults.py",
        ("ALONG", "LEAST_ARM", "LEAST_SAMPLES", "STEP_SHARE", "STEP_STDS", "LEAST_STEP", "EDGE"),
        PLANAR,
    ),
    Held("vision/planar/fit_plane.py", ("FOCAL_STD", "BEND_STD", "LEAN_STD"), PLANAR),
    Held("vision/planar/fit_plane.py", ("PRINT_STD_M", "DOT_STD_M"), PLANAR),
    Held(
        "vision/rig/standing_still.py",
        ("NO_COURSE", "AT_THE_NOISE"),
        "tests/vision/rig/test_standing_still.py",
    ),
    Held("vision/track_run.py", ("LEFT_OUT_MOSTLY",), "tests/vision/test_seen_wrong.py"),
    Held("vision/planar/track_planar.py", ("LEAST_FRAMES", "FARTHEST_M"), PLANAR),
)  # fmt: skip


def line_of(text: str, name: str) -> re.Match[str]:
    """The line that gives a constant its number, as (before, number, after).

    Raises:
        ValueError: where there is none, or where it is not a plain number.
    """
    found = re.search(rf"(?m)^({name} = )(-?[0-9][0-9_.e*/ +-]*?)((?:  #.*)?)$", text)
    if found is None:
        raise ValueError(f"no line gives {name} a number: rename it in tests/house/wreck.py too")
    return found


def moved(text: str, name: str, factor: float) -> float:
    """A constant of a file made larger or smaller; counts by at least one."""
    value = eval(line_of(text, name)[2], {"__builtins__": {}})
    by_factor: float = value * factor
    if not isinstance(value, int):
        return by_factor
    return max(value + 1, round(by_factor)) if factor > 1.0 else min(value - 1, round(by_factor))


def wrecked(text: str, name: str, factor: float) -> str:
    """The file's text with one constant made larger or smaller."""
    found = line_of(text, name)
    value = moved(text, name, factor)
    return f"{text[: found.start()]}{found[1]}{value!r}{found[3]}{text[found.end() :]}"


def noticed_by(file: str, text: str, tests: str) -> bool:
    """Whether the tests fail, for a reason of their own, while a file of the product reads `text`.

    They run in a child process, whose import of the file is handed that text; the tree stays as it
    is. Compiled functions are kept by their content: those that hold the constant are made anew.
    """
    child = in_child(lambda: _run(file, text, tests))
    code = os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])
    if code not in (0, 1):
        raise RuntimeError(f"pytest could not be run on {tests}: exit status {code}")
    return code == 1


def _run(file: str, text: str, tests: str) -> int:
    target = (ROOT / file).resolve()
    usual = SourceFileLoader.get_code

    def get_code(self: SourceFileLoader, fullname: str) -> CodeType | None:
        if Path(self.path).resolve() == target:
            return compile(text, self.path, "exec", dont_inherit=True)
        return usual(self, fullname)

    SourceFileLoader.get_code = get_code  # pyright: ignore[reportAttributeAccessIssue]
    return pytest_main(["-x", "-q", *tests.split()])


def chosen(words: list[str]) -> dict[str, list[tuple[str, str, str, float]]]:
    """By tests: file, name, which way and factor of each wreck to be tried."""
    found: dict[str, list[tuple[str, str, str, float]]] = {}
    for held in HELD:
        for name in held.names:
            if not words or any(word in f"{held.file} {name}" for word in words):
                ways = (("larger", LARGER), ("smaller", SMALLER))
                found.setdefault(held.tests, []).extend((held.file, name, *way) for way in ways)
    return found


def unnoticed(tests: str, wrecks: list[tuple[str, str, str, float]]) -> list[str]:
    """Which of the wrecks that these tests should notice they do not."""
    texts = {file: (ROOT / file).read_text(encoding="utf-8") for file, *_ in wrecks}
    quick = [one for one in wrecks if can_be_in_place(one[0], one[1], tests)]
    values = [(file, name, moved(texts[file], name, factor)) for file, name, _, factor in quick]
    noticed = noticed_in_place(tests, values) if quick else []
    left = [one for one, seen in zip(quick, noticed, strict=True) if not seen]
    left += [one for one in wrecks if one not in quick]
    return [
        f"{file}: {name} made {word}"
        for file, name, word, factor in left
        if not noticed_by(file, wrecked(texts[file], name, factor), tests)
    ]


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("words", nargs="*", help="only constants whose file or name holds one")
    wrecks = chosen(parser.parse_args().words)
    for library in ("numpy", "scipy.optimize", "scipy.signal", "numba", "casadi", "cv2", "pytest"):
        importlib.import_module(library)
    missed: list[str] = []
    for tests, some in wrecks.items():
        now = unnoticed(tests, some)
        print(f"{len(some)} wrecks, {len(now)} unnoticed by {tests}", *now, sep="\n  ")  # noqa: T201
        sys.stdout.flush()
        missed += now
    count = sum(len(some) for some in wrecks.values())
    print(f"{count} wrecks, {len(missed)} unnoticed", *missed, sep="\n  ")  # noqa: T201
    return 1 if missed or not count else 0


if __name__ == "__main__":
    sys.exit(main())
