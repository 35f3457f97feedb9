"""Driving: the road of the learner's policy, and the expert's beside it, seen from behind."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import rerun as rr
import rerun.blueprint as rrb
from numpy.typing import NDArray

from walking_irl.arrays import Array
from walking_irl.domains.mdp.driving import DrivingPicture
from walking_irl.recording import style
from walking_irl.recording.drawing import log_pair, text_3d
from walking_irl.recording.experiment import Clock

STEPS, LAST_STEPS = 14, 38
"""Steps of a drive that are played."""
FRAMES_PER_STEP = 8
PIXEL = 0.1
"""Units of the scene per pixel of the domain."""
NEAR, FAR = -5.0, 19.0
"""Ends of the road that is shown; the driven car is at 0."""
BETWEEN = 13.5
"""From the middle of the learner's road to the middle of the expert's."""
DASH, DASH_GAP = 1.6, 2.4
BODY_HEIGHT, CABIN_HEIGHT = 0.8, 0.6
SPEEDS = ("slow", "medium", "fast")
POSITION = "curves/position"


class Road(NamedTuple):
    """A drive and the frame it is drawn in."""

    picture: DrivingPicture
    x: float
    """Where the middle of the road is."""

    @property
    def middle(self) -> float:
        """Middle of the road [px]."""
        return float(self.picture.road.mean())

    def across(self, pixel: Array) -> Array:
        """Positions across the road, [px] -> scene."""
        return self.x + PIXEL * (np.asarray(pixel, dtype=np.float64) - self.middle)

    def ahead(self, pixel: Array) -> Array:
        """Heights [px] -> distance ahead of the driven car."""
        return PIXEL * (float(self.picture.blue[0, 1]) - np.asarray(pixel, dtype=np.float64))


class Drive(NamedTuple):
    """A drive frame by frame, n frames."""

    x: Array
    """Position of the driven car across the road, shape (n,)."""
    travelled: Array
    """Distance that the scene has moved, shape (n,)."""
    others: Array
    """Centres of the other car and of the one after it, shape (n, 2, 2); NaN where unseen."""
    is_colliding: NDArray[np.bool_]
    """Shape (n,)."""


class DrivingView:
    """Shows drives of one road, from behind and above.

    Args:
        picture: Any drive, for the road's sizes.
        expert: The expert's drive, or None where it is not known.
    """

    curves_name = "Position across the road [px]"

    def __init__(self, picture: DrivingPicture, expert: DrivingPicture | None = None) -> None:
        self.expert = None if expert is None else Road(expert, BETWEEN / 2)
        self._x = 0.0 if expert is None else -BETWEEN / 2
        self._any = picture

    def log_static(self, stream: rr.RecordingStream) -> None:
        """Log the roads and the cars' sizes."""
        stream.log("world", rr.ViewCoordinates.RIGHT_HAND_Z_UP, static=True)
        _log_road(stream, "world/learner", Road(self._any, self._x))
        _log_looks(stream, "world/learner")
        if self.expert is not None:
            _log_road(stream, "world/expert", self.expert)
            _log_looks(stream, "world/expert")
        log_pair(stream, POSITION, "position", self.expert is not None)

    def log_iteration(
        self, stream: rr.RecordingStream, clock: Clock, motion: DrivingPicture, is_last: bool
    ) -> int:
        """Drive for some steps."""
        clock.set(stream)
        roads = {"learner": Road(motion, self._x)}
        if self.expert is not None:
            roads["expert"] = self.expert
        steps = min(LAST_STEPS if is_last else STEPS, len(motion.blue) - 1)
        n = steps * FRAMES_PER_STEP
        across = []
        for who, road in roads.items():
            drive = play(road, n)
            _log_drive(stream, clock, f"world/{who}", road, drive)
            at = np.array([[road.x, NEAR - 0.3, 0.0]])
            stream.log(f"world/{who}/name", text_3d(at, [headline(who, road.picture)]))
            across.append((drive.x - road.x) / PIXEL)
        values = rr.Scalars.columns(scalars=np.stack(across, axis=1).ravel())
        stream.send_columns(POSITION, clock.columns(n), values.partition([len(roads)] * n))
        return n

    def view(self) -> rrb.View:
        """From behind and above."""
        return rrb.Spatial3DView(
            origin="/world",
            name="Driving",
            background=style.PAPER,
            line_grid=False,
            eye_controls=rrb.EyeControls3D(
                position=(0.0, -10.9, 17.0), look_target=(0.0, 4.5, 0.0), eye_up=(0, 0, 1)
            ),
        )

    def curves(self) -> list[str]:
        """Where the car is across the road."""
        return [f"/{POSITION}"]

    def describe(self) -> str:
        """One sentence for the summary."""
        also = " beside the expert's (**red** car)" if self.expert is not None else ""
        return (
            f"a drive of the learner's policy (**blue** car){also}; the same "
            "lanes are drawn for both, a car that collides turns **orange**, green is off the road"
        )


def headline(who: str, picture: DrivingPicture) -> str:
    """What a drive is like, in words."""
    speed = SPEEDS[int(picture.speed[0])]
    hits, off = int(picture.is_colliding.sum()), int(picture.is_off_road.sum())
    return f"{who}: {speed}; of {len(picture.blue)} steps {hits} collide, {off} leave the road"


def play(road: Road, n: int) -> Drive:
    """Frames of a drive: cars move evenly between steps."""
    picture = road.picture
    step, part = np.divmod(np.arange(n), FRAMES_PER_STEP)
    after, share = step + 1, part / FRAMES_PER_STEP
    advance = PIXEL * picture.advance[step]
    x = road.across(picture.blue[:, 0])
    others = np.stack([road.across(picture.red[:, 0]), road.ahead(picture.red[:, 1])], axis=1)
    old, new = others[step].copy(), others[after].copy()
    is_new = new[:, 1] > old[:, 1]  # the old one was passed
    old[:, 1] -= share * advance
    new[:, 1] += (1 - share) * advance
    new[~is_new] = np.nan
    return Drive(
        x[step] + share * (x[after] - x[step]),
        np.concatenate([[0.0], np.cumsum(PIXEL * picture.advance)])[step] + share * advance,
        np.stack([old, new], axis=1),
        picture.is_colliding[step],
    )


def _log_road(stream: rr.RecordingStream, root: str, road: Road) -> None:
    """Grass as wide as the car can go, asphalt, and lines at the edges."""
    picture = road.picture
    half = picture.car[0] / 2
    grass = road.across(picture.sides + [-half, half])
    asphalt = road.across(picture.road)
    strips = [(*grass, -0.12, style.GRASS), (*asphalt, -0.08, style.ASPHALT)]
    strips += [(e - 0.07, e + 0.07, -0.04, style.PAPER) for e in asphalt]
    boxes = rr.Boxes3D(
        centers=[[(a + b) / 2, (NEAR + FAR) / 2, z] for a, b, z, _ in strips],
        half_sizes=[[(b - a) / 2, (FAR - NEAR) / 2, 0.02] for a, b, _, _ in strips],
        colors=[colour for *_, colour in strips],
        fill_mode="solid",
    )
    stream.log(f"{root}/road", boxes, static=True)


def _log_looks(stream: rr.RecordingStream, root: str) -> None:
    """What does not change of cars and lane marks."""
    for path, colours in (
        ("car/body", None),  # its colour tells of collisions
        ("car/cabin", [style.GLASS]),
        ("others/body", [style.INK]),
        ("others/cabin", [style.GLASS]),
        ("marks", [style.PAPER]),
    ):
        look = rr.Boxes3D.from_fields(colors=colours, fill_mode="solid")
        stream.log(f"{root}/{path}", look, static=True)


def _log_drive(
    stream: rr.RecordingStream, clock: Clock, root: str, road: Road, drive: Drive
) -> None:
    n, index = len(drive.x), clock.columns(len(drive.x))
    own = style.LEARNER if root.endswith("learner") else style.EXPERT
    paint = np.where(drive.is_colliding[:, None], style.FORCE, own)
    here = np.stack([drive.x, np.zeros(n)], axis=1)[:, None]
    _log_cars(stream, index, f"{root}/car", road.picture.car, here, paint)
    _log_cars(stream, index, f"{root}/others", road.picture.car, drive.others)
    low, high = _marks(road, drive.travelled)
    counts = [len(frame) for frame in low]
    low_, high_ = np.vstack(low), np.vstack(high)
    boxes = rr.Boxes3D.columns(centers=(low_ + high_) / 2, half_sizes=(high_ - low_) / 2)
    stream.send_columns(f"{root}/marks", index, boxes.partition(counts))


def _log_cars(
    stream: rr.RecordingStream, index: list[rr.TimeColumn], path: str, size: Array, at: Array,
    paint: NDArray[np.int_] | None = None,
) -> None:  # fmt: skip
    """Cars with centres of shape (n, m, 2), cut off at the ends of the road."""
    low = np.clip(at[..., 1] - PIXEL * size[1] / 2, NEAR, FAR)
    high = np.clip(at[..., 1] + PIXEL * size[1] / 2, NEAR, FAR)
    is_seen = np.nan_to_num(high - low) > 1e-6
    counts = is_seen.sum(axis=1)
    x, low, high = at[is_seen, 0], low[is_seen], high[is_seen]
    y, half = (low + high) / 2, (high - low) / 2
    width = PIXEL * size[0] / 2
    for part, z, height, inset in (
        ("body", BODY_HEIGHT / 2, BODY_HEIGHT, 0.90),
        ("cabin", BODY_HEIGHT + CABIN_HEIGHT / 2, CABIN_HEIGHT, 0.70),
    ):
        centres = np.stack([x, y, np.full(len(x), z)], axis=1)
        long = half * (inset if part == "body" else 0.45)
        sizes = np.stack(
            [np.full(len(x), width * inset), long, np.full(len(x), height / 2)], axis=1
        )
        boxes = {"centers": centres, "half_sizes": sizes}
        if part == "body" and paint is not None:
            boxes["colors"] = paint.astype(np.uint8)[is_seen.ravel()]
        columns = rr.Boxes3D.columns(**boxes)
        stream.send_columns(f"{path}/{part}", index, columns.partition(counts))


def _marks(road: Road, travelled: Array) -> tuple[list[Array], list[Array]]:
    """Corners of the dashes between lanes, frame by frame, cut off at the ends of the road."""
    lanes = road.across(road.picture.lanes)
    lines = (lanes[1:] + lanes[:-1]) / 2
    period = DASH + DASH_GAP
    lows, highs = [], []
    for moved in travelled:
        start = np.arange(NEAR - period - (moved % period), FAR + period, period) + period
        a, b = np.clip(start, NEAR, FAR), np.clip(start + DASH, NEAR, FAR)
        a, b = a[b > a], b[b > a]
        x, z = np.repeat(lines, len(a)), np.full(len(a) * len(lines), -0.05)
        a, b = np.tile(a, len(lines)), np.tile(b, len(lines))
        lows.append(np.stack([x - 0.07, a, z], axis=1))
        highs.append(np.stack([x + 0.07, b, z + 0.02], axis=1))
    return lows, highs
