"""What is left out, and the choice by it."""

import numpy as np

from discovery.sparse.folds import choose, make_blocks, make_folds


def test_blocks_cover_recordings_in_proportion() -> None:
    long, short = np.arange(0.0, 3600, 10), np.arange(0.0, 360, 10)
    blocks = make_blocks([long, short], 11)
    assert list(np.bincount(blocks.recording)) == [10, 1]
    assert blocks.of[0].max() == 9
    assert set(blocks.of[1]) == {10}


def test_one_recording_is_left_out_in_quarters_and_several_one_by_one() -> None:
    time = np.arange(0.0, 3600, 10)
    alone = make_folds(make_blocks([time], 12))
    assert [len(fold) for fold in alone] == [3, 3, 3, 3]
    blocks = make_blocks([time, time, time], 12)
    for k, fold in enumerate(make_folds(blocks)):
        assert set(blocks.recording[fold]) == {k}


def test_a_quarter_of_each_recording_is_left_out_where_all_are_needed() -> None:
    blocks = make_blocks([np.arange(0.0, 4800.0, 60.0), np.arange(0.0, 2400.0, 60.0)], 12)
    folds = make_folds(blocks, whole=False)
    assert [fold.tolist() for fold in folds] == [[0, 1, 8], [2, 3, 9], [4, 5, 10], [6, 7, 11]]


def test_a_pause_of_the_logger_is_no_block() -> None:
    time = np.r_[np.arange(0.0, 300.0, 5.0), np.arange(1000.0, 1200.0, 5.0)]
    blocks = make_blocks([time], 12)
    assert sorted(set(blocks.of[0])) == list(range(blocks.count))
    assert all(np.isin(fold, blocks.of[0]).all() for fold in make_folds(blocks))


def test_the_sparsest_of_equals_is_chosen() -> None:
    rng = np.random.default_rng(0)
    noise = rng.uniform(0.8, 1.2, 24)
    bad, good, richer = 3 * noise, noise, noise * rng.uniform(0.97, 1.02, 24)
    assert choose(np.array([bad, good, richer]), 2.0) == 1
    assert choose(np.array([bad, 2 * good, good]), 2.0) == 2
