r"""The optimal gait as a sparse least-squares problem, through MuJoCo's inverse dynamics.

Unknowns are the knots of half a cycle, the step length and the half period (:class:`~.gait.Gait`).
Inverse dynamics turns them into joint torques, sensor readings and the forces that would have to
act on the unactuated root; those are penalised away:

.. math:: \min_x \; w \cdot G(x), \qquad G_j = F_j/\text{scale}_j + C + \rho \, |f_\text{root}|^2

T. Erez, E. Todorov (2012), Trajectory optimization for domains with contacts using inverse
dynamics. The derivatives of inverse dynamics are closed forms (:mod:`~.dynamics`), chained onto
the unknowns by :mod:`~.chain` and, for second derivatives, :mod:`~.hessian`.
"""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from typing import Any, NamedTuple

import mujoco
import numpy as np

from walking_irl.arrays import Array, Indices
from walking_irl.domains.humanoid.body.anatomy import Walker
from walking_irl.domains.humanoid.costs.base import Channels
from walking_irl.domains.humanoid.costs.defaults import DEFAULT_COSTS, UNIT, Costs
from walking_irl.domains.humanoid.costs.stack import cost_stack
from walking_irl.domains.humanoid.gait.gait import Gait
from walking_irl.domains.humanoid.optimiser.dynamics.inverse import Derivatives, InverseDynamics

ROOT_PENALTY = 1e6 / UNIT
"""rho; leaves root forces of about 1e-5 body weights, so that the gait can be simulated."""
ANCHOR_WEIGHTS = np.array([100.0, 100.0, 900.0]) / UNIT
"""Of squared anchors: start at x = 0, feet side by side at mid-step [1/m^2], period [1/s^2]."""
PERIOD_RANGE = (0.35, 1.0)  # of the half period [s]


class Evaluation(NamedTuple):
    """A gait with everything that its costs need."""

    x: Array
    motion: Channels
    residuals: Array
    """Of all costs, shape (N, M); their columns are those of the cost stack."""
    root: Array
    """Root forces over body weight, moments over half a body weight times a metre, (N, n_root)."""
    anchors: Array
    """Start position [m], feet at mid-step [m], excess half period [s]; shape (3,)."""
    objective_costs: Array
    """Scaled costs F_j / scale_j, shape (K,)."""
    shared: float
    """Fixed part without the root penalty and the anchors of the cycle."""
    anchoring: float
    """What fixes where the cycle starts: the solver's alone, in nobody's features."""
    root_square: float

    def total_costs(self) -> Array:
        """Total costs G at full root penalty, shape (K,)."""
        return self.objective_costs + self.shared + ROOT_PENALTY * self.root_square

    def total(self, w: Array, penalty: float) -> float:
        """What the solver minimises at weights ``w`` and a given root penalty."""
        return float(
            w @ self.objective_costs + self.shared + self.anchoring + penalty * self.root_square
        )


class Transcription:
    """Evaluates gaits of a walker and the derivatives of its inverse dynamics.

    Args:
        walker: Who walks.
        costs: What for.
        n_knots: Knots N of half a cycle.
        threads: Threads over which the knots are divided; each has an ``MjData`` of its own.
    """

    def __init__(
        self,
        walker: Walker,
        costs: Costs = DEFAULT_COSTS,
        *,
        n_knots: int = 40,
        threads: int = 1,
    ) -> None:
        self.walker = walker
        self.stack = cost_stack(walker, costs)
        self.n_knots = n_knots
        self.threads = threads
        self.nv = len(walker.joints)
        self.size = n_knots * self.nv + 2
        is_slide = walker.model.jnt_type[: walker.n_root] == mujoco.mjtJoint.mjJNT_SLIDE
        self.root_unit = walker.weight * np.where(is_slide, 1.0, 0.5)
        self.motors = np.arange(walker.n_root, self.nv)
        self.feet = np.array([walker.sensor[f"ankle_{s}"].start for s in "lr"])
        self.sensors: Indices = np.union1d(self.stack.sensors, self.feet)
        self._pool: ThreadPoolExecutor | None = None
        self._data: list[Any] = []
        self._dynamics: InverseDynamics | None = None

    def __getstate__(self) -> dict[str, Any]:
        """Everything but the scratch space of this process."""
        return {**self.__dict__, "_pool": None, "_data": [], "_dynamics": None}

    def motion(self, x: Array) -> tuple[Array, Array, Array, Gait]:
        """Positions of the N knots, velocities of N + 1 and accelerations of N knots."""
        gait = Gait(x[:-2].reshape(self.n_knots, self.nv), float(x[-2]), float(x[-1]))
        mirror = self.walker.mirror
        before, after = mirror @ gait.q[-1], mirror @ gait.q[0]
        before[0] -= gait.step_length
        after[0] += gait.step_length
        v = np.diff(np.vstack([before, gait.q, after]), axis=0) / gait.timestep
        return gait.q, v, np.diff(v, axis=0) / gait.timestep, gait

    def evaluate(self, x: Array) -> Evaluation:
        """Costs of the gait ``x``."""
        q, v, a, gait = self.motion(x)
        force = np.empty((self.n_knots, self.nv))
        sensor = np.empty((self.n_knots, self.walker.model.nsensordata))

        def work(knots: range, data: Any) -> None:
            model, inverse = self.walker.model, mujoco.mj_inverse
            qpos, qvel, qacc = data.qpos, data.qvel, data.qacc  # views: each costs a lookup
            forces, sensors = data.qfrc_inverse, data.sensordata
            for i in knots:
                qpos[:], qvel[:], qacc[:] = q[i], v[i], a[i]
                inverse(model, data)
                force[i], sensor[i] = forces, sensors

        self._over_knots(work)
        return self._assemble(x, q, v, a, gait, force, sensor)

    @property
    def dynamics(self) -> InverseDynamics:
        """Differentiates inverse dynamics; its ``reason`` says whether there is a closed form."""
        if self._dynamics is None:
            self._dynamics = InverseDynamics(self.walker.model)
        return self._dynamics

    def differentiate(self, ev: Evaluation) -> Derivatives:
        """Derivatives of inverse dynamics at all knots."""
        return self.dynamics.at(ev.motion.q, ev.motion.v, ev.motion.a)

    def _over_knots(self, work: Any) -> None:
        if not self._data:
            self._data = [mujoco.MjData(self.walker.model) for _ in range(self.threads)]
        if self.threads == 1:
            work(range(self.n_knots), self._data[0])
            return
        if self._pool is None:
            self._pool = ThreadPoolExecutor(self.threads)
        edges = np.linspace(0, self.n_knots, self.threads + 1).astype(int)
        parts = [range(a, b) for a, b in zip(edges[:-1], edges[1:], strict=True)]
        list(self._pool.map(work, parts, self._data))

    def _assemble(
        self,
        x: Array,
        q: Array,
        v: Array,
        a: Array,
        gait: Gait,
        force: Array,
        sensor: Array,
    ) -> Evaluation:
        walker = self.walker
        last = walker.sensor_mirror @ sensor[0] + walker.sensor_advance * gait.step_length
        tau = force[:, walker.n_root :]
        motion = Channels(
            q=q,
            v=v[:-1],
            v_next=v[1:],
            a=a,
            tau=tau,
            tau_next=np.vstack([tau[1:], walker.torque_mirror @ tau[0]]),
            s=sensor,
            s_next=np.vstack([sensor[1:], last]),
            h=gait.timestep,
            distance=gait.step_length,
        )
        r = self.stack.residuals(motion)
        root = force[:, : walker.n_root] / self.root_unit
        left, right = sensor[self.n_knots // 2, self.feet]
        low, high = PERIOD_RANGE
        period = gait.half_period
        anchors = np.array([q[0, 0], left - right, min(0, period - low) + max(0, period - high)])
        costs, shared = self.stack.costs_of(r, motion.pace)
        pulls = ANCHOR_WEIGHTS * anchors**2
        shared += float(pulls[2])
        anchoring = float(pulls[:2].sum())
        root_square = float(np.sum(root * root) / self.n_knots)
        return Evaluation(x, motion, r, root, anchors, costs, shared, anchoring, root_square)
