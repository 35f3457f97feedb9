"""Recordings are read as what they show, whatever their dialect, axes, units and gaps."""

from dataclasses import replace

import numpy as np
import pytest
from person_files import (
    clinical,
    gait2392,
    npz,
    part,
    radians,
    recording,
    sheet,
    storage,
    with_gaps,
    z_up,
)

from walking_irl.domains.humanoid.body.load import load_walker
from walking_irl.domains.humanoid.gait.files import save_gait
from walking_irl.domains.humanoid.gait.gait import Gait, whole_cycle
from walking_irl.domains.humanoid.gait.library import load_gaits
from walking_irl.domains.humanoid.recorded.cycle import HARMONICS
from walking_irl.domains.humanoid.recorded.person import Options
from walking_irl.domains.humanoid.recorded.reader import LEGS, read_person
from walking_irl.errors import InvalidInputError

WALKER = load_walker()
GAIT = load_gaits()["reference"]
COLUMNS = [WALKER.joints.index(n) for n in LEGS]
SINK = 0.02
"""The model's soles sink 14 mm under load, so its own walks look so much shorter-legged."""
ROLL = 0.05
"""The lowest sole point rolls, so the speed that it tells is a little low."""


def legs_apart(a, b):
    """Root mean square difference of the legs' angles [deg]."""
    return float(np.rad2deg(np.sqrt(np.mean((a.q[:, COLUMNS] - b.q[:, COLUMNS]) ** 2))))


def as_read(gait):
    """The gait as recordings are read: thighs as they are, pelvis without its mean tilt."""
    q = gait.q.copy()
    tilt = q[:, WALKER.joints.index("root_pitch")].mean()
    for side in "rl":
        q[:, WALKER.joints.index(f"hip_flexion_{side}")] -= tilt
    return replace(gait, q=q)


def with_harmonics(gait, n):
    """The gait with its first n harmonics only; x, which advances, is spoilt."""
    f = np.fft.rfft(whole_cycle(gait, WALKER.mirror), axis=0)
    f[n + 1 :] = 0
    return replace(gait, q=np.fft.irfft(f, 2 * gait.n_knots, axis=0)[: gait.n_knots])


SHOWN = as_read(GAIT)
"""What a recording of GAIT shows."""
TIMING = 0.1
"""Contacts to a thousandth of a cycle: legs turn by a degree rms in a hundredth [deg]."""
CUT = legs_apart(with_harmonics(GAIT, HARMONICS), GAIT) + TIMING
"""The harmonics that are kept leave this much of a gait whose contacts are sharp [deg rms]."""


@pytest.fixture
def read(tmp_path):
    def read(content, name="walk.mot", options=None):
        data = content if isinstance(content, bytes) else content.encode()
        (tmp_path / name).write_bytes(data)
        return read_person([tmp_path / name], WALKER, options)

    return read


@pytest.fixture(scope="module")
def walk():
    return recording(GAIT, WALKER)


def test_a_model_walk_comes_back_within_the_cut_of_the_harmonics(read, walk):
    person = read(storage(walk))
    assert legs_apart(person.gait, SHOWN) < CUT
    assert person.half_period == pytest.approx(GAIT.half_period, abs=0.003)
    assert person.step_length == pytest.approx(GAIT.step_length, rel=0.01)
    assert person.heading == pytest.approx(25, abs=0.5)
    assert person.scale == pytest.approx(1, abs=SINK) and person.belt == 0
    assert person.convention == "opensim" and person.unit == "degrees" and not person.missing


def test_the_hips_are_as_high_as_the_model_s_own(read, walk):
    """Root's z counts from upright standing; soles of the model sink by about a centimetre."""
    z = WALKER.joints.index("root_z")
    apart = read(storage(walk)).gait.q[:, z] - GAIT.q[:, z]
    assert np.abs(apart).max() < SINK  # m


def test_noise_of_two_degrees_is_averaged(read):
    """Three whole cycles: noise of 2 degrees falls below 2 / sqrt(3 cycles x 2 sides) + the cut."""
    noisy = recording(GAIT, WALKER, cycles=4, noise=2.0, rng=np.random.default_rng(1))
    person = read(storage(noisy))
    assert legs_apart(person.gait, SHOWN) < 2 / np.sqrt(6) + CUT
    assert 1.0 < person.residual < 2.5


DIALECTS = {
    "version 3, no unit": lambda c: (storage(radians(c), version=3, degrees=None), "w.sto"),
    "radians": lambda c: (storage(radians(c), degrees="no"), "w.sto"),
    "degrees called radians": lambda c: (storage(c, degrees="no"), "w.mot"),
    "radians called degrees": lambda c: (storage(radians(c)), "w.mot"),
    "gait2392": lambda c: (storage(gait2392(c)), "w.mot"),
    "paths": lambda c: (storage(radians(c), paths=True, degrees="no"), "w.sto"),
    "CRLF and spaces": lambda c: (storage(c, end="\r\n", wide=True), "w.MOT"),
    "plain csv": lambda c: (sheet(c), "w.csv"),
    "byte order mark": lambda c: (b"\xef\xbb\xbf" + sheet(c).encode(), "w.csv"),
    "utf-16": lambda c: (sheet(c, split="\t").encode("utf-16"), "w.csv"),
    "decimal commas": lambda c: (
        sheet(
            c,
            split=";",
            point=",",
            names=[
                "time",
                *(f"{n} (deg)" for n in list(c)[1:4]),
                *(f"{n} [m]" for n in list(c)[4:7]),
                *(f"{n} (deg)" for n in list(c)[7:]),
            ],
        ),
        "w.csv",
    ),
    "comments": lambda c: (sheet(c, comment="inDegrees = yes"), "w.csv"),
    "row of units": lambda c: (
        sheet(c, units=["s", *["deg"] * 3, *["m"] * 3, *["deg"] * (len(c) - 7)]),
        "w.csv",
    ),
    "npz": lambda c: (npz(c), "w.npz"),
    "clinical": lambda c: (sheet(clinical(c)), "w.csv"),
    "z up": lambda c: (storage(z_up(c)), "w.mot"),
    "only the path is z up": lambda c: (
        storage({**c, "pelvis_ty": -c["pelvis_tz"], "pelvis_tz": c["pelvis_ty"]}),
        "w.mot",
    ),
    "millimetres": lambda c: (
        storage(
            {
                n: v * 1000 if n in ("pelvis_tx", "pelvis_ty", "pelvis_tz") else v
                for n, v in c.items()
            }
        ),
        "w.mot",
    ),
    "milliseconds": lambda c: (storage({**c, "time": c["time"] * 1000}), "w.mot"),
    "long names": lambda c: (
        sheet({n.replace("knee_angle_r", "Right Knee Flexion"): v for n, v in c.items()}),
        "w.csv",
    ),
}


@pytest.mark.parametrize("dialect", DIALECTS)
def test_dialects_say_the_same(read, walk, dialect):
    person = read(*DIALECTS[dialect](walk))
    assert legs_apart(person.gait, read(storage(walk)).gait) < 0.01
    assert person.speed == pytest.approx(GAIT.speed, rel=0.015)


@pytest.mark.parametrize("heading", [-75.0, 90.0, 180.0, 200.0])
@pytest.mark.parametrize("belt", [0.0, GAIT.speed])
def test_any_direction_and_a_treadmill(read, heading, belt):
    person = read(storage(recording(GAIT, WALKER, heading=heading, belt=belt)))
    assert legs_apart(person.gait, SHOWN) < CUT
    assert person.speed == pytest.approx(GAIT.speed, rel=ROLL if belt else 0.01)
    assert person.belt == pytest.approx(belt, rel=ROLL)
    assert any("treadmill" in n for n in person.notes) == (belt > 0)


@pytest.mark.parametrize("start", [0.0, 0.1, 0.35, 0.8])
def test_any_start_of_the_record(read, start):
    person = read(storage(recording(GAIT, WALKER, start=start, cycles=1.5)))
    assert legs_apart(person.gait, SHOWN) < CUT


@pytest.mark.parametrize("hz", [50.0, 60.0, 240.0, 1000.0])
def test_any_rate(read, hz):
    person = read(storage(recording(GAIT, WALKER, hz=hz)))
    assert legs_apart(person.gait, SHOWN) < CUT
    assert person.rate == pytest.approx(hz, rel=1e-3)


@pytest.mark.parametrize("size", [0.7, 1.05])
def test_lengths_scale_with_the_legs_and_times_with_their_square_root(read, size):
    person = read(storage(recording(GAIT, WALKER, size=size)))
    assert person.scale * size == pytest.approx(1, abs=SINK)
    assert person.half_period == pytest.approx(GAIT.half_period * np.sqrt(size), rel=0.01)
    assert person.gait.step_length == pytest.approx(GAIT.step_length, rel=0.03)
    assert person.gait.half_period == pytest.approx(GAIT.half_period, rel=0.02)


def test_a_pelvis_and_trunk_frame_of_another_marker_set_do_not_matter(read):
    """Thirteen degrees of pelvic tilt, and a trunk whose zero leans by ten: thighs stay."""
    walk = recording(GAIT, WALKER, heading=0)
    tilted = dict(walk)
    tilted["pelvis_tilt"] = walk["pelvis_tilt"] - 13
    for side in "rl":
        tilted[f"hip_flexion_{side}"] = walk[f"hip_flexion_{side}"] + 13
    tilted["lumbar_extension"] = walk["lumbar_extension"] + 3
    person, plain = read(storage(tilted)), read(storage(walk))
    assert legs_apart(person.gait, plain.gait) < 1.0
    assert person.pelvis_offset == pytest.approx(plain.pelvis_offset + 13, abs=0.5)


def test_a_turning_walk_is_read_where_it_is_straight(read):
    columns = recording(GAIT, WALKER, cycles=9, turn=(6.0, 1.2), heading=30.0)
    person = read(storage(columns))
    assert legs_apart(person.gait, SHOWN) < CUT
    assert person.heading == pytest.approx(30, abs=3)
    assert any("straight" in n for n in person.notes)


def test_gaps_jitter_and_repeated_times_are_named_and_do_not_matter(read, walk):
    gap = read(storage(with_gaps(walk, 40, 48)))
    assert legs_apart(gap.gait, SHOWN) < CUT and any("gap" in n for n in gap.notes)
    tail = read(storage(with_gaps(with_gaps(walk, 200, 232), 60, 80)))
    assert legs_apart(tail.gait, SHOWN) < 2.5
    rng = np.random.default_rng(0)
    time = walk["time"] + rng.uniform(-0.003, 0.003, len(walk["time"]))
    order = np.argsort(time)
    at = time - walk["time"][0]
    shaken = recording(GAIT, WALKER)
    shaken = {n: np.interp(time, walk["time"], c) for n, c in shaken.items()}
    shaken["time"] = at
    shaken = part(shaken, np.sort(np.r_[order, 30, 30, 31]))
    person = read(storage(shaken))
    assert legs_apart(person.gait, SHOWN) < CUT
    assert any("repeat" in n for n in person.notes)


@pytest.mark.parametrize("value", [np.inf, 1e300, -1e9])
@pytest.mark.parametrize("name", ["pelvis_tx", "hip_flexion_l", "time"])
def test_a_single_absurd_number_is_a_gap_or_refused(read, walk, name, value):
    spoilt = {n: c.copy() for n, c in walk.items()}
    spoilt[name][70] = value
    try:
        person = read(storage(spoilt))
    except InvalidInputError:
        return
    assert legs_apart(person.gait, SHOWN) < CUT


def test_an_empty_column_counts_as_missing(read, walk):
    person = read(storage(with_gaps(walk, 0, 220, ["elbow_flex_r"])))
    assert "elbow_flex_r" in person.missing
    assert legs_apart(person.gait, SHOWN) < CUT


def test_without_a_path_the_feet_say_how_far(read, walk):
    angles = {n: c for n, c in walk.items() if n not in ("pelvis_tx", "pelvis_ty", "pelvis_tz")}
    person = read(storage(angles))
    assert any("height" in n for n in person.notes)
    assert legs_apart(person.gait, SHOWN) < CUT
    assert person.speed == pytest.approx(GAIT.speed, rel=0.1)


def test_a_table_in_percent_needs_the_time_of_a_cycle(tmp_path, walk):
    one = recording(GAIT, WALKER, cycles=1.0, hz=100 / (2 * GAIT.half_period), heading=0)
    one = {"percent": np.arange(len(one["time"]), dtype=float), **clinical(one)}
    del one["time"]
    keep = [n for n in one if not n.endswith("_l") and not n.startswith("pelvis_t")]
    both = {n: c for n, c in one.items() if not n.startswith("pelvis_t") or n == "pelvis_tilt"}
    mean = {n.removesuffix("_r"): one[n] for n in keep} | {"pelvis_tilt": one["pelvis_tilt"]}
    options = Options(cycle_time=2 * GAIT.half_period)
    for name, columns in (("both.csv", both), ("one.csv", mean)):
        (tmp_path / name).write_text(sheet(columns))
        with pytest.raises(InvalidInputError, match="cycle-time"):
            read_person([tmp_path / name], WALKER)
        person = read_person([tmp_path / name], WALKER, options)
        assert legs_apart(person.gait, SHOWN) < CUT, name
        assert person.half_period == pytest.approx(GAIT.half_period)


@pytest.mark.parametrize("name", ["gait.npz", "gait.csv"])
def test_own_gait_files_are_read_as_walks(tmp_path, name):
    save_gait(tmp_path / name, GAIT, WALKER)
    person = read_person([tmp_path / name], WALKER)
    assert person.convention == "own" and person.scale == 1
    assert legs_apart(person.gait, GAIT) < CUT
    assert person.speed == pytest.approx(GAIT.speed, rel=0.01)


def test_many_cycles_have_a_covariance_that_tells_the_noise(read):
    """The mean of n cycles is off by about its standard error, over all joints and knots."""
    noisy = recording(GAIT, WALKER, cycles=10, noise=2.0, rng=np.random.default_rng(3))
    clean = read(storage(recording(GAIT, WALKER, cycles=10)))
    person = read(storage(noisy))
    assert person.cycles >= 8
    C = person.covariance
    assert C.shape == (40 * 25 + 2,) * 2 and np.allclose(C, C.T)
    error = (person.gait.q - clean.gait.q)[:, 6:].ravel()
    told = np.sqrt(np.diag(C)[:-2].reshape(40, 25)[:, 6:].ravel())
    assert 0.5 < np.sqrt(np.mean(error**2)) / np.sqrt(np.mean(told**2)) < 2.0
    assert read(storage(recording(GAIT, WALKER, cycles=1.2))).covariance is None


def test_trials_of_one_person_are_averaged(tmp_path):
    paths = []
    for k in range(4):
        rng = np.random.default_rng(k)
        columns = recording(GAIT, WALKER, cycles=1.3, noise=2.0, heading=90.0 * k, rng=rng)
        paths.append(tmp_path / f"trial{k}.mot")
        paths[-1].write_text(storage(columns))
    person = read_person(paths, WALKER)
    alone = [legs_apart(read_person([p], WALKER).gait, SHOWN) for p in paths]
    assert legs_apart(person.gait, SHOWN) < 0.8 * np.mean(alone)
    assert person.cycles == 4 and person.covariance is not None
    assert person.sources == tuple(paths)


def test_trials_of_different_people_are_refused(tmp_path):
    for k, size in enumerate((0.7, 1.0)):
        (tmp_path / f"{k}.mot").write_text(storage(recording(GAIT, WALKER, size=size)))
    with pytest.raises(InvalidInputError, match="one person"):
        read_person([tmp_path / "0.mot", tmp_path / "1.mot"], WALKER)


# --- what is no walk


def standing(columns):
    return {n: c if n == "time" else c[0] + 0 * c for n, c in columns.items()}


def backwards(columns):
    """The film runs backwards."""
    return {n: c if n == "time" else c[::-1] for n, c in columns.items()}


def run():
    return Gait(GAIT.q, 1.0, 0.34)


REFUSED = {
    "standing": (lambda c: storage(standing(c)), "stands"),
    "running": (lambda c: storage(recording(run(), WALKER, cycles=3)), "running"),
    "backwards": (lambda c: storage(backwards(c)), "backwards"),
    "backwards on a treadmill": (
        lambda c: storage(backwards(recording(GAIT, WALKER, belt=GAIT.speed))),
        "backwards",
    ),
    "short": (lambda c: storage(part(c, slice(0, 35))), "short"),
    "a handful of rows": (lambda c: storage(part(c, slice(0, 5))), "short"),
    "nothing but gaps": (lambda c: storage(with_gaps(c, 3, 300)), "hip_flexion_r"),
    "no left knee": (
        lambda c: storage({n: v for n, v in c.items() if n != "knee_angle_l"}),
        "knee_angle_l",
    ),
    "no time": (lambda c: npz({n: v for n, v in c.items() if n != "time"}), "time"),
    "lying": (lambda c: storage({**c, "pelvis_list": c["pelvis_list"] + 180}), "upright"),
    "frame numbers": (
        lambda c: storage({**c, "time": np.arange(len(c["time"]), dtype=float)}),
        "seconds",
    ),
    "one long gap of time": (lambda c: storage({**c, "time": 0 * c["time"] + 1}), "time"),
}


@pytest.mark.parametrize("fault", REFUSED)
def test_what_is_no_walk_is_refused_in_one_sentence(read, walk, fault):
    make, word = REFUSED[fault]
    content = make(walk)
    name = "w.npz" if isinstance(content, bytes) else "w.mot"
    with pytest.raises(InvalidInputError, match=word) as caught:
        read(content, name)
    assert name in str(caught.value) and "\n" not in str(caught.value)


def test_crouched_and_slow_walks_are_still_walks(read):
    """Knees bent by 25 degrees more; and the same steps at two thirds of the speed."""
    q = GAIT.q.copy()
    for side in "rl":
        for joint, more in (("knee", 25), ("hip_flexion", 12), ("ankle", 13)):
            q[:, WALKER.joints.index(f"{joint}_{side}")] += np.deg2rad(more)
    q[:, 2] -= 0.03
    crouched = Gait(q, GAIT.step_length, GAIT.half_period)
    found = read(storage(recording(crouched, WALKER)))
    # bent knees move where the ankles pass, and with it the first knot, by .4 % of a cycle
    assert legs_apart(found.gait, as_read(crouched)) < CUT + 0.3
    slow = Gait(GAIT.q, GAIT.step_length, 0.79)
    found = read(storage(recording(slow, WALKER, cycles=3)))
    assert found.speed == pytest.approx(slow.speed, rel=0.02)
