"""What a person sees on opening a recording."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import rerun.blueprint as rrb

from walking_irl.recording import style
from walking_irl.recording.experiment import Experiment
from walking_irl.recording.interval_bars import BARS, bounds
from walking_irl.recording.panels import Panel, has_wide_view, panels
from walking_irl.recording.progress_view import (
    FIGURES,
    FLOOR,
    distance_path,
    feature_path,
    share_path,
    weight_path,
)
from walking_irl.recording.views.view import WorldView

MOST_PLOTS = 4
"""Curves of a world that have a plot each."""
MOST_ROWS = 7
"""Rows of the text's table that are seen at once; for more, the lower part is higher."""


def blueprint(experiment: Experiment, world: WorldView[Any] | None) -> rrb.Blueprint:
    """World left, polyhedron right; below intervals, certificate and a short text.

    Curves of further points stand in the world's place where there is none, else in a tab.
    """
    shown = panels(experiment.names)
    is_wide = has_wide_view(experiment, world is None)
    shadows = [shadow_view(panel, len(shown), is_wide) for panel in shown]
    curves = _others(experiment)
    beside = [rrb.Vertical(*curves)] if curves else []
    left: list[rrb.View | rrb.Container] = [world.view()] if world is not None else [*beside]
    share = 1.8 if world is None else max(0.7, 0.5 * len(shadows))
    right = [rrb.Horizontal(*shadows, name="Weights that explain the expert")] if shadows else []
    top = [*left, *right]
    bottom = rrb.Horizontal(
        rrb.Tabs(
            bars_view(experiment),
            _history(experiment),
            *([] if world is None else curves),
            active_tab=0,
        ),
        _certificate(experiment),
        rrb.Tabs(
            rrb.TextDocumentView(origin="/summary", name="What to look at"),
            rrb.TextLogView(origin="/log", name="Log"),
            plot_view("Features", [f"/{feature_path(name)}" for name in experiment.names]),
            *([] if world is None else [plot_views(world.curves_name, world.curves())]),
            active_tab=0,
        ),
        column_shares=[1.15, 1.0, 1.0],
    )
    columns = ([1.0] if left else []) + ([share] if right else [])
    rows = [rrb.Horizontal(*top, column_shares=columns), bottom] if top else [bottom]
    upper = 1.75 if len(experiment.names) <= MOST_ROWS else 1.2
    return window(rrb.Vertical(*rows, row_shares=[upper, 1.0][: len(rows)]))


def motion_blueprint(world: WorldView[Any], plots: Mapping[str, Sequence[str]]) -> rrb.Blueprint:
    """One motion alone: the world, and beside it the text, further plots and the joints."""
    text = rrb.TextDocumentView(origin="/summary", name="Summary")
    further = [plot_view(name, list(curves)) for name, curves in plots.items()]
    curves = [*further, plot_view(world.curves_name, world.curves())]
    side = rrb.Vertical(text, *curves, row_shares=[1.3, *(1.0 for _ in curves)])
    return window(rrb.Horizontal(world.view(), side, column_shares=[1.7, 1.0]))


def window(content: rrb.Container) -> rrb.Blueprint:
    """A blueprint that plays at once and shows nothing but ``content``."""
    return rrb.Blueprint(
        content,
        rrb.TimePanel(
            timeline="frame", state="collapsed", fps=style.PLAYBACK_RATE, play_state="playing"
        ),
        rrb.SelectionPanel(state="collapsed"),
        rrb.BlueprintPanel(state="collapsed"),
        auto_views=False,
        auto_layout=False,
    )


def shadow_view(panel: Panel, n_panels: int, is_wide: bool) -> rrb.View:
    """A panel of the polyhedron, seen so that it fills its view."""
    position, target = (2.45, 1.6, 0.62), (0.3, 0.3, -0.03)
    if panel.is_flat:
        position, target = (0.92, 0.43, 1.85), (0.92, 0.43, 0.0)
        if is_wide:
            position, target = (0.75, 0.4, 1.3), (0.75, 0.4, 0.0)
    elif n_panels == 1:  # the regular tetrahedron
        position, target = (2.25, 1.55, 0.6), (0.42, 0.42, 0.12)
        if is_wide:
            position, target = (1.68, 1.44, 0.81), (0.41, 0.645, 0.48)
    elif n_panels > 2:  # narrow views
        position = (3.0, 2.0, 0.75)
    up = (0.0, 1.0, 0.0) if panel.is_flat else (0.0, 0.0, 1.0)
    return rrb.Spatial3DView(
        origin=f"/{panel.path}",
        name=f"Weights: {panel.title}",
        background=style.PAPER,
        line_grid=False,
        eye_controls=rrb.EyeControls3D(position=position, look_target=target, eye_up=up),
    )


def bars_view(experiment: Experiment, name: str = "Intervals of the weights") -> rrb.View:
    """The intervals of all weights."""
    x_range, y_range = bounds(experiment.names)
    return rrb.Spatial2DView(
        origin=f"/{BARS}",
        name=name,
        background=style.PAPER,
        visual_bounds=rrb.VisualBounds2D(x_range=x_range, y_range=y_range),
    )


def _history(experiment: Experiment) -> rrb.Container:
    plots = [
        rrb.TimeSeriesView(
            origin=f"/{weight_path(name)}",
            name=name,
            plot_legend=rrb.PlotLegend(visible=False),
            axis_y=rrb.ScalarAxis(range=(0.0, 1.0), zoom_lock=True),
        )
        for name in experiment.names
    ]
    return rrb.Grid(*plots, grid_columns=3, name="Intervals over time")


def _certificate(experiment: Experiment) -> rrb.View:
    """Figures that fall: their legend stands where they do not come."""
    largest = float(np.abs(experiment.expert.mu).sum())
    top = 0.3 + max(0.0, math.log10(max(largest, 1.0)))
    return rrb.TimeSeriesView(
        origin="/cpirl/log10",
        contents=[f"/cpirl/log10/{key}" for key in FIGURES if key != "regret"],
        name="Powers of ten: certificate, regret, loss, volume",
        axis_x=_whole_run(),
        axis_y=rrb.ScalarAxis(range=(math.log10(FLOOR), top)),
        plot_legend=rrb.PlotLegend(rrb.Corner2D.RightTop),
        background=rrb.archetypes.PlotBackground(color=style.PAPER, show_grid=False),
    )


def plot_view(name: str, curves: list[str]) -> rrb.View:
    """Curves over the whole run."""
    return rrb.TimeSeriesView(
        origin="/",
        contents=curves,
        name=name,
        axis_x=_whole_run(),
        background=rrb.archetypes.PlotBackground(color=style.PAPER, show_grid=False),
        plot_legend=rrb.PlotLegend(rrb.Corner2D.RightTop),
    )


def plot_views(name: str, curves: list[str]) -> rrb.View | rrb.Container:
    """A plot a curve, which shows learner and expert; many share one."""
    if len(curves) > MOST_PLOTS:
        return plot_view(name, curves)
    shown = [plot_view(curve.rsplit("/", 1)[-1], [curve]) for curve in curves]
    return rrb.Vertical(*shown, name=name)


def _others(experiment: Experiment) -> list[rrb.View]:
    """Curves of the further points."""
    if not experiment.others:
        return []
    views = [
        rrb.TimeSeriesView(
            origin="/",
            contents=[f"/{share_path(name)}" for name in experiment.others],
            name="Share of the volume that a query there leaves",
            axis_x=_whole_run(),
            axis_y=rrb.ScalarAxis(range=(0.0, 1.0)),
            background=rrb.archetypes.PlotBackground(color=style.PAPER, show_grid=False),
            plot_legend=rrb.PlotLegend(visible=False),
        )
    ]
    if experiment.w_expert is not None:
        paths = [f"/{distance_path(name)}" for name in experiment.others]
        views.insert(0, plot_view("Distance to the ground-truth weights (log10, L1)", paths))
    return views


def _whole_run() -> rrb.TimeAxis:
    """From the first frame to the last, wherever the cursor is."""
    ends = rrb.TimeRangeBoundary.infinite()
    return rrb.TimeAxis(view_range=rrb.TimeRange(start=ends, end=ends))
