"""Looking at an episode: pictures without a screen, or a window that follows the walker."""

from __future__ import annotations

import os
import sys
import time
from typing import Any

import mujoco

from walking_irl.domains.humanoid.body.anatomy import Walker
from walking_irl.domains.humanoid.gait.pictures import (
    LOOK_AT_HEIGHT,
    OVERSAMPLING,
    SIDE,
    Image,
    open_renderer,
    shrink,
)
from walking_irl.errors import InvalidInputError

DISTANCE = 3.2  # of the camera [m]
SCREENS = ("DISPLAY", "WAYLAND_DISPLAY")


class Camera:
    """Takes pictures of a walker from the side.

    Args:
        walker: Whom to follow.
        height: Of a picture [pixels].
        width: Of a picture [pixels].
    """

    def __init__(self, walker: Walker, height: int, width: int) -> None:
        model = walker.model
        self._renderer = open_renderer(model, height * OVERSAMPLING, width * OVERSAMPLING)
        self._option = mujoco.MjvOption()
        self._option.geomgroup[:] = [1, 1, 1, 0, 0, 0]
        self._option.sitegroup[:] = 0
        self._camera = mujoco.MjvCamera()
        self._camera.distance = DISTANCE
        self._camera.azimuth, self._camera.elevation = SIDE

    def picture(self, data: mujoco.MjData) -> Image:
        """The walker as it stands, shape (height, width, 3)."""
        self._camera.lookat[:] = [data.qpos[0], 0.0, LOOK_AT_HEIGHT]
        self._renderer.update_scene(data, self._camera, self._option)
        return shrink(self._renderer.render())

    def close(self) -> None:
        """Free the graphics memory."""
        self._renderer.close()


class Window:
    """MuJoCo's viewer, which shows an episode as fast as it would happen.

    Args:
        model: Of the simulation that is shown.
        data: Its state.
        timestep: Between two pictures [s].

    Raises:
        InvalidInputError: If there is no screen.
    """

    def __init__(self, model: mujoco.MjModel, data: mujoco.MjData, timestep: float) -> None:
        if sys.platform.startswith("linux") and not any(map(os.environ.get, SCREENS)):
            raise InvalidInputError(
                "render_mode 'human' needs a screen; without one use render_mode 'rgb_array'"
            )
        self._viewer = _open_viewer(model, data)
        self._viewer.cam.distance = DISTANCE
        self._viewer.cam.azimuth, self._viewer.cam.elevation = SIDE
        self._data, self._timestep, self._next = data, timestep, time.monotonic()

    def show(self) -> None:
        """Draw the present state, not before its time."""
        self._viewer.cam.lookat[:] = [self._data.qpos[0], 0.0, LOOK_AT_HEIGHT]
        self._viewer.sync()
        now = time.monotonic()
        self._next = max(self._next + self._timestep, now)
        time.sleep(self._next - now)

    def close(self) -> None:
        """Close the window."""
        self._viewer.close()


def _open_viewer(model: mujoco.MjModel, data: mujoco.MjData) -> Any:
    import mujoco.viewer as viewer

    return viewer.launch_passive(model, data, show_left_ui=False, show_right_ui=False)
