"""The command that repeats one recovery."""

from __future__ import annotations

import shlex
from dataclasses import fields

from walking_irl.run.setup import Setup

_ELSEWHERE = ("options", "seed", "record", "checkpoint", "weights", "demonstration")


def flags_of(setup: Setup) -> list[str]:
    """Flags of ``recover`` and ``study`` that make a setup, its seed left aside.

    >>> flags_of(Setup(domain="lqr", centre="cg", max_solves=9, options={"rollouts": 0}))
    ['--domain', 'lqr', '--centre', 'cg', '--max-solves', '9', '--rollouts', '0']
    """
    given = {f.name: getattr(setup, f.name) for f in fields(setup) if f.name not in _ELSEWHERE}
    given = {k: v for k, v in given.items() if v != getattr(Setup, k)}
    pairs = [(f"--{k.replace('_', '-')}", str(v)) for k, v in {**given, **setup.options}.items()]
    return [word for pair in pairs for word in pair]


def recover_command(setup: Setup) -> str:
    """The command that recovers one expert of a study again, alone.

    >>> recover_command(Setup(domain="lqr", seed=7))
    'walking-irl recover --domain lqr --seed 7'
    """
    words = ["walking-irl", "recover", *flags_of(setup), "--seed", str(setup.seed)]
    return shlex.join(words)
