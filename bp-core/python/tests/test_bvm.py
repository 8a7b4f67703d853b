"""The map and the head with arrays. Expected values: by hand, or by the geometry of the picture."""

import math

import numpy as np
import pytest

import bayesian_programs as bp
from bayesian_programs import bvm


@pytest.fixture
def small():
    return bvm.Map(cells_rho=6, rho_min_m=0.5, rho_max_m=4.0, azimuth_cells=24, elevation_cells=12)


def test_a_new_map_knows_nothing(small):
    assert small.shape == (6, 12, 24)
    assert small.occupancy.dtype == np.float32 and (small.occupancy == 0.5).all()
    np.testing.assert_allclose(small.occupancy_entropy, math.log(2), rtol=1e-6)
    # Cells are as deep as they are wide: edges grow by one factor.
    np.testing.assert_allclose(np.diff(np.log(small.edges_m)), math.log(8) / 6)
    assert small.edges_m[0] == 0.5 and small.edges_m[-1] == pytest.approx(4.0)
    np.testing.assert_allclose(small.velocity.sum(axis=0), 1.0, rtol=1e-6)
    assert small.velocities[0] == [0, 0, 0]


def test_a_wall_is_seen_where_it_is(small):
    ranges = np.full((12, 24), np.nan, np.float32)
    azimuth, elevation = np.argmin(abs(small.azimuths - 0.1)), 6
    ranges[elevation, azimuth] = 2.0
    shell = np.searchsorted(small.edges_m, 2.0) - 1
    for _ in range(8):
        small.see(ranges, sigma_m=0.02)
    ray = small.occupancy[:, elevation, azimuth]
    assert ray.argmax() == shell and ray[shell] > 0.9
    assert (ray[:shell] < 0.1).all()
    # Other directions are only predicted.
    assert abs(small.occupancy[0, 0, 0] - 0.5) < 0.05
    assert small.entropy.sum() < bvm.Map(
        cells_rho=6, rho_min_m=0.5, rho_max_m=4.0, azimuth_cells=24, elevation_cells=12
    ).entropy.sum()


def test_likelihoods_are_bayes_rule(small):
    """Without motion one step is Bayes' rule in each cell; the prediction mixes equal neighbours."""
    likelihood = np.ones((2, *small.shape), np.float32)
    likelihood[1] *= 3.0
    small.observe(likelihood)
    np.testing.assert_allclose(small.occupancy, 0.75, atol=1e-5)
    strided = np.ones((2, 6, 12, 48), np.float32)[..., ::2]
    small.observe(strided)
    small.observe()


def test_a_depth_image_becomes_ranges(small):
    depth = np.full((40, 40), np.nan, np.float32)
    # Right of the middle and above it: azimuth negative, elevation positive.
    depth[10, 30] = 2.0
    ranges = small.ranges(depth, focal_px=(20.0, 20.0), centre_px=(20.0, 20.0))
    ((row, column),) = np.argwhere(np.isfinite(ranges))
    assert abs(small.azimuths[column] - -math.atan2(0.5, 1.0)) <= math.pi / 24
    assert abs(small.elevations[row] - math.atan2(0.5, math.hypot(1.0, 0.5))) <= math.pi / 24
    assert ranges[row, column] == pytest.approx(2.0 * math.sqrt(1.5), rel=1e-6)
    turned = small.ranges(depth, focal_px=(20.0, 20.0), centre_px=(20.0, 20.0), yaw=math.radians(30))
    ((_, further),) = np.argwhere(np.isfinite(turned))
    assert further == column + 2


def test_a_gaze_goes_to_what_is_unknown(small):
    gaze = small.gaze(yaw=0.0)
    assert gaze.score > 0 and abs(gaze.azimuth) < 0.4 and abs(gaze.elevation) < 0.4


def test_a_robot_s_head_looks_and_is_told_where_to_look_next():
    head = bvm.Head(cells_rho=6, rho_max_m=4.0, azimuth_cells=24, elevation_cells=12)
    depth = np.full((48, 64), 2.0, np.float32)
    records = [
        head.look(depth, focal_px=(40, 40), centre_px=(31.5, 23.5), yaw=0.3, time_s=0.1 * at) for at in range(3)
    ]
    assert [record["number"] for record in records] == [1, 2, 3]
    assert records[0]["attitude"]["yaw"] == 0.3 and records[0]["senses"][0]["readings"] > 5
    assert records[2]["entropy"] < records[0]["entropy"]
    assert set(records[0]["next"]) >= {"azimuth", "elevation", "score"}
    assert head.map.occupancy.max() > 0.8
    with pytest.raises(bp.InputError, match="needs `depth`"):
        head.look()


def test_a_simulated_head_explores():
    head = bvm.Head.simulated(seed=2)
    first, second = head.look(), head.look()
    assert second["entropy"] < first["entropy"]
    with pytest.raises(bp.InputError, match="measures by itself"):
        head.look(np.ones((4, 4), np.float32))


def test_disparities_of_a_shifted_picture():
    random = np.random.default_rng(1)
    texture = random.uniform(0, 255, (24, 72)).astype(np.float32)
    left, right = texture[:, :64].copy(), texture[:, 5 : 5 + 64].copy()
    found, confidence = bvm.disparities(left, right, most=12)
    inner = np.isfinite(found[4:-4, 20:-8])
    assert inner.mean() > 0.5
    assert np.median(found[4:-4, 20:-8][inner]) == pytest.approx(5.0, abs=0.3)
    assert ((confidence > 0) == np.isfinite(found)).all()


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda m: m.see(np.ones((3, 3), np.float32)), r"shape \[3, 3\].*\[12, 24\]"),
        (lambda m: m.see(np.full((12, 24), np.inf, np.float32)), "a range is inf m"),
        (lambda m: m.gaze(yaw=math.nan), "`yaw` is NaN"),
        (lambda m: m.ranges(np.ones((4, 4), np.float32), focal_px=(1, 1), centre_px=(1, 1), roll=math.inf), "`roll` is inf"),
        (lambda m: m.see(np.full((12, 24), -1.0, np.float32)), "a range is -1 m"),
        (lambda m: m.see(np.ones((12, 24), np.float32), sigma_m=0.0), "sigma_m is 0"),
        (lambda m: m.see(np.ones((12, 24), np.float32), confidence=2.0), "confidence is 2"),
        (lambda m: m.see(np.ones((12, 24), np.float32), evidence="soft"), "`soft`"),
        (lambda m: m.observe(np.ones((2, 6, 12, 20), np.float32)), "a likelihood has the shape"),
        (lambda m: m.observe(np.full((2, 6, 12, 24), np.nan, np.float32)), "contains NaN"),
        (lambda m: bvm.Map(azimuth_cells=7), "azimuth_cells"),
    ],
)
def test_wrong_arrays_say_what_to_mend(small, call, message):
    with pytest.raises(bp.InputError, match=message):
        call(small)


def test_wrong_types_of_arrays_are_refused(small):
    with pytest.raises(TypeError):
        small.see(np.ones((12, 24), np.int64))
    with pytest.raises(TypeError):
        small.see(np.ones(12, np.float32))


def test_an_experiment_is_rows():
    rows = bvm.experiment(["empty", "furnished"], ["sweep", "floor"], [3, 1], steps=2)
    order = [(scene, policy, seed) for scene in ("empty", "furnished") for policy in ("sweep", "floor") for seed in (3, 1)]
    assert [(row["scene"], row["policy"], row["seed"]) for row in rows] == order
    # The floor sees the whole sphere at each look and does not turn: it knows more of what is visible.
    for sweep, floor in zip(rows[:2] + rows[4:6], rows[2:4] + rows[6:]):
        assert floor["reachable"] < sweep["reachable"] and floor["visible"] == sweep["visible"]
        assert (floor["travel_rad"], floor["seconds"], floor["steps"]) == (0.0, 1.0, 2)
    # A row depends on its own scene, policy and seed only: it may be computed anywhere.
    (alone,) = bvm.experiment(["furnished"], ["sweep"], [1], 2)
    assert {**alone, "decision_us": 0.0} == {**rows[5], "decision_us": 0.0}


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ((["moon"], ["view"], [1], 2), "there is no scene `moon`"),
        ((["empty"], ["stare"], [1], 2), "there is no policy `stare`: expected inhibited"),
        ((["empty"], ["view"], [1], 0), "steps is 0"),
    ],
)
def test_an_experiment_names_what_is_wrong(arguments, message):
    with pytest.raises(bp.Error, match=message):
        bvm.experiment(*arguments)


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda m: m.see(np.ones((12, 24))), r"`ranges` is an array of float64 .*\[12, 24\].*float32 .*\(elevation, azimuth\)"),
        (lambda m: m.see(np.ones(12, np.float32)), r"`ranges` is an array of float32 .*\[12\]"),
        (lambda m: m.see([[1.0]]), "`ranges` is a `list`"),
        (lambda m: m.observe(np.ones((2, 6, 12, 24), bool)), "`likelihood` is an array of bool"),
        (lambda m: bvm.disparities(np.ones((4, 4), int), np.ones((4, 4), np.float32), most=2), "`left` is an array of int64"),
        (lambda m: bvm.Head().look(np.ones((4, 4)), focal_px=(1, 1), centre_px=(1, 1)), "`depth` is an array of float64"),
    ],
)
def test_wrong_arrays_say_what_to_give(small, call, message):
    with pytest.raises(TypeError, match=message):
        call(small)


def test_a_head_refuses_an_attitude_that_is_not_a_number():
    head, depth = bvm.Head(), np.ones((4, 4), np.float32)
    for wrong in ({"yaw": math.nan}, {"time_s": math.inf}):
        with pytest.raises(bp.InputError, match="must be a finite number"):
            head.look(depth, focal_px=(1, 1), centre_px=(1, 1), **wrong)
    assert head.look(depth, focal_px=(1, 1), centre_px=(1, 1))["number"] == 1
