"""``walking-irl recover --walk FILE...``: what a person walks for, from recordings."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from itertools import combinations
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from rich.console import Console
from rich.markup import escape
from rich.table import Table

from walking_irl.cli import DONE
from walking_irl.cli.read import FLAGS, add_options, options_of, to_json
from walking_irl.errors import InvalidInputError
from walking_irl.files import check_ending, check_outputs, write_json
from walking_irl.workers import workers

if TYPE_CHECKING:
    from walking_irl.domains.humanoid.recorded.feasible import Feasible
    from walking_irl.domains.humanoid.recorded.person import Person
    from walking_irl.run.walk import Explanation

RESTS_ON = (
    "5. What it rests on: one body with these objectives for everybody (the recording is "
    "scaled to its legs); of all gaits as near to the recording, the one that is cheapest for the "
    "weights; of weights that the walk leaves open, those nearer to the reference; vertical forces "
    "where they were measured, else joint angles alone; habits, pain and muscles that the body has "
    "not got count as weights."
)


class Answer(NamedTuple):
    """A person and what was found."""

    person: Person
    near: Feasible
    found: Explanation

    @property
    def name(self) -> str:
        """Of its files."""
        return ", ".join(p.name for p in self.person.sources)


def add_arguments(p: argparse.ArgumentParser) -> None:
    """Arguments for recordings of people."""
    group = p.add_argument_group(
        "a person", "recordings as `walking-irl read` understands them, which shows them first"
    )
    group.add_argument(
        "--walk",
        nargs="+",
        action="append",
        type=Path,
        metavar="FILE",
        help="trials of one person, with their force files; once more for another, to compare",
    )
    group.add_argument(
        "--accept-habit",
        action="store_true",
        help="give weights even where the body cannot follow the walk",
    )

    add_options(group)


def refuse_alone(args: argparse.Namespace) -> None:
    """Complain about arguments that need ``--walk``.

    Raises:
        InvalidInputError: If one is given without it.
    """
    for name, flag in {"accept_habit": "--accept-habit", **FLAGS}.items():
        if getattr(args, name) is not None and getattr(args, name) is not False:
            raise InvalidInputError(f"{flag} goes with --walk")


def run(args: argparse.Namespace, given: dict[str, Any], console: Console) -> int:
    """The recovery; ``given`` are arguments that other recoveries take."""
    from walking_irl.domains.humanoid.spec import HUMANOID

    _refuse_others(args, given)
    check_ending(args.record, ".rrd")
    check_outputs([args.json, args.record], inputs=[p for paths in args.walk for p in paths])
    options = options_of(args)
    people = [_read(paths, HUMANOID.walker, options) for paths in args.walk]
    answers = []
    with workers(copied=True) as executor:
        for person, trials in people:
            answers.append(_explain(person, trials, args, console, executor))
    if args.record is not None:
        _record(args.record, answers[0], HUMANOID)
    if args.json is not None:
        write_json(args.json, _to_json(answers, HUMANOID))
    for answer in answers:
        _show(answer, HUMANOID, console)
    for a, b in combinations(answers, 2):
        _compare(a, b, HUMANOID, console)
    console.print(RESTS_ON)
    return DONE


def _refuse_others(args: argparse.Namespace, given: dict[str, Any]) -> None:
    options = given.get("options", {})
    others = [*(k for k, v in given.items() if v and k != "options"), *options]
    others += [n for n in ("method", "resume", "trajectories", "horizon") if getattr(args, n)]
    if others:
        flags = ", ".join("--" + name.replace("_", "-") for name in others)
        raise InvalidInputError(
            f"{flags}: without effect on a recorded walk, leave out with --walk"
        )


def _read(paths: Sequence[Path], walker: Any, options: Any) -> tuple[Person, list[Person]]:
    """A person, and each trial where there are several."""
    from walking_irl.domains.humanoid.recorded.person import averaged
    from walking_irl.domains.humanoid.recorded.reader import read_trials

    trials = read_trials(paths, walker, options)
    return (averaged(trials), trials) if len(trials) > 1 else (trials[0], [])


def _explain(
    person: Person, trials: list[Person], args: argparse.Namespace, console: Console, executor: Any
) -> Answer:
    from walking_irl.domains.humanoid.recorded.feasible import check_habit
    from walking_irl.domains.humanoid.spec import HUMANOID
    from walking_irl.run.walk import explain, nearest

    walks = [p.walk for p in (person, *trials)]
    names = escape(", ".join(p.name for p in person.sources))
    _say(
        f"{names}: {person.speed:.2f} m/s; looking for the nearest gait of the body ...",
        args,
        console,
    )
    near = nearest(HUMANOID, walks[0], executor)
    check_habit(near, args.accept_habit)
    _say(
        f"{near.sagittal:.1f} degrees off at hips, knees and ankles; looking for weights ...",
        args,
        console,
    )
    found = explain(HUMANOID, walks[0], near, trials=walks[1:], executor=executor)
    return Answer(person, near, found)


def _say(text: str, args: argparse.Namespace, console: Console) -> None:
    if not args.quiet:
        console.print(text)


def _show(answer: Answer, spec: Any, console: Console) -> None:
    """The answer, in the order in which it should be read."""
    found, person, end = answer.found, answer.person, answer.found.end
    worst = sorted(end.near.degrees, key=lambda n: -end.near.degrees[n])[:3]
    places = ", ".join(f"{n} {end.near.degrees[n]:.1f}" for n in worst)
    low, high = (100 * b for b in found.bracket)
    console.print(
        f"\n[bold]{escape(answer.name)}[/bold]\n"
        f"1. How near the body comes: {end.near.sagittal:.1f} degrees at hips, knees and ankles "
        f"(farthest: {places}).\n"
        f"2. Such a walk costs {low:.1f} to {high:.1f} % more than the best one for the weights "
        "that speak most for it.\n"
        "3. These weights:"
    )
    console.print(_weights(answer, spec))
    best, shown = end.gait, person.gait
    console.print(
        f"4. The best gait for them: {found.sagittal:.1f} degrees from the recording at hips, "
        f"knees and ankles; {best.speed:.2f} m/s ({shown.speed:.2f}), "
        f"steps of {best.step_length:.2f} m "
        f"({shown.step_length:.2f}), {60 / best.half_period:.0f} a minute "
        f"({60 / shown.half_period:.0f}), all in the body's size{_forces(answer, spec)}."
    )


def _weights(answer: Answer, spec: Any) -> Table:
    found = answer.found
    table = Table("objective", "weight", "half width", "of it: walk", "starts", "trials")
    rows = zip(found.w, found.half, found.allowed, found.starts, found.trials, strict=True)
    for objective, numbers in zip(spec.stack.objectives, rows, strict=True):
        table.add_row(objective.name, *(f"{v:.3f}" for v in numbers))
    return table


def _record(path: Path, answer: Answer, spec: Any) -> None:
    """The first person's answer, as a recording."""
    from walking_irl.run.walk_film import record_explanation

    found, near = answer.found, answer.found.end.near
    low, high = (100 * b for b in found.bracket)
    rows = [
        f"| {o.name} | {w:.3f} | {h:.3f} |"
        for o, w, h in zip(spec.stack.objectives, found.w, found.half, strict=True)
    ]
    text = "\n".join(
        [
            f"The body comes within **{near.sagittal:.1f} degrees** of the recording at hips, "
            f"knees and ankles. Such a walk costs **{low:.1f} to {high:.1f} %** more than the best "
            "one for any weights. The weights that speak most for it:",
            "",
            "| objective | weight | half width |",
            "|---|---|---|",
            *rows,
            "",
            RESTS_ON[3:],
        ]
    )
    record_explanation(path, spec, answer.person, found, text)


def _forces(answer: Answer, spec: Any) -> str:
    """How far vertical forces are from measured ones, which the nearest gait was drawn to."""
    from walking_irl.run.walk_report import force_apart

    force = answer.person.force
    if force is None:
        return ""
    near, best = (
        force_apart(spec.walker, gait, force[:, 2])
        for gait in (answer.found.end.near.gait, answer.found.end.gait)
    )
    return (
        f"; vertical force {best:.2f} body weights from the measured one over stance "
        f"(the nearest gait: {near:.2f})"
    )


def _difference(a: Answer, b: Answer) -> tuple[Any, Any]:
    """Difference of two people's weights, and its half widths."""
    return a.found.w - b.found.w, np.hypot(a.found.half, b.found.half)


def _compare(a: Answer, b: Answer, spec: Any, console: Console) -> None:
    """Which weights of two people differ beyond what is known."""
    apart, known = _difference(a, b)
    console.print(f"\n[bold]{escape(a.name)} against {escape(b.name)}[/bold]")
    table = Table("objective", "difference", "half width", "beyond it")
    names = [o.name for o in spec.stack.objectives]
    beyond = np.abs(apart) > known
    for name, d, h, is_real in zip(names, apart, known, beyond, strict=True):
        table.add_row(name, f"{d:+.3f}", f"{h:.3f}", "yes" if is_real else "no")
    console.print(table)
    differ = [n for n, is_real in zip(names, beyond, strict=True) if is_real]
    console.print(
        f"They differ in {', '.join(differ)}, beyond what is known."
        if differ
        else "They differ in no weight beyond what is known."
    )


def _to_json(answers: Sequence[Answer], spec: Any) -> dict[str, Any]:
    from walking_irl.run.walk_report import explanation_json
    from walking_irl.versions import versions

    return {
        "objectives": [o.name for o in spec.stack.objectives],
        "people": [
            {"read": to_json(a.person), **explanation_json(a.found, a.person.gait)} for a in answers
        ],
        "comparisons": [
            {
                "people": [a.name, b.name],
                "difference": apart.tolist(),
                "half_widths": known.tolist(),
                "beyond": (np.abs(apart) > known).tolist(),
            }
            for a, b in combinations(answers, 2)
            for apart, known in [_difference(a, b)]
        ],
        "versions": versions(),
    }
