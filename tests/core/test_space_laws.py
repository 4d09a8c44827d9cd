"""Choices by weight: what weights can be, and which word a coordinate means."""

import pytest

from skidpad.core.errors import ConfigError
from skidpad.core.maths.space import Choice


def test_a_word_of_weight_zero_is_never_drawn():
    law = Choice(("never", "a", "b", "nor this"), (0.0, 0.1, 0.2, 0.0))
    assert {law.value(k / 1000.0) for k in range(1000)} == {"a", "b"}
    assert law.value(1.0 - 1e-17) == "b", "nor where shares add up to a hair below 1"
    assert law.likelihood("never") == 0.0
    assert law.likelihood("a") == 0.5


@pytest.mark.parametrize("weights", [(0.0, 0.0), (1.0,), (-1.0, 2.0), (float("nan"), 1.0)])
def test_weights_that_make_no_distribution_are_one_sentence(weights):
    with pytest.raises(ConfigError, match="weights of 2 words must be as many"):
        Choice(("a", "b"), weights)


def test_without_weights_words_are_alike():
    law = Choice(("a", "b"))
    assert [law.value(0.2), law.value(0.7)] == ["a", "b"]
