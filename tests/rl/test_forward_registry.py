import importlib

import pytest

from walking_irl.rl.registry import FINITE, LINEAR_QUADRATIC, METHODS


@pytest.mark.parametrize("method", METHODS.values(), ids=METHODS)
def test_every_entry_names_a_module_that_says_where_it_comes_from(method):
    module = importlib.import_module(f"walking_irl.rl.{method.module}")
    author = method.source.split()[0]
    text = module.__doc__ + "".join(
        getattr(f, "__doc__", None) or "" for f in vars(module).values() if callable(f)
    )
    text += importlib.import_module("walking_irl.rl.approximators").nearest_neighbours.__doc__
    assert author in text
    assert set(method.worlds) <= {FINITE, LINEAR_QUADRATIC}
    assert method.needs
    assert method.guarantee
