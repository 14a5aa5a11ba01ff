"""What a search may add to the effects that it has."""

from __future__ import annotations

from types import SimpleNamespace

from discovery.diagnosis.selection import not_twice


def claim(*amplitudes: str) -> SimpleNamespace:
    return SimpleNamespace(hypothesis=SimpleNamespace(amplitudes=amplitudes))


def test_two_effects_never_share_a_size() -> None:
    """A jet that wets less of `a` and more of `b`, and one that wets less of `b` and more of `c`, have the
    size at `b` in common: a model of both has fewer sizes than the two say, and its evidence cannot be
    computed.
    """
    first = SimpleNamespace(amplitudes=("jet_a", "jet_b"))
    pool = [claim("jet_b", "jet_c"), claim("jet_c", "jet_d"), claim("lag")]
    assert not_twice(pool, [first]) == pool[1:]  # type: ignore[arg-type, list-item]
    assert not_twice(pool, []) == pool  # type: ignore[arg-type]
