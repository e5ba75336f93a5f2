from time import sleep

import pytest

from fieldalign.clock import Clock


def test_a_lap_is_since_the_last_one():
    clock = Clock()
    sleep(0.02)
    clock.lap("long")
    clock.lap("short")
    assert list(clock.laps) == ["long", "short"]
    assert clock.laps["long"] >= 0.02
    assert clock.laps["short"] < 0.02


def test_laps_of_one_name_are_added():
    clock = Clock()
    for _ in range(3):
        sleep(0.01)
        clock.lap("round")
    assert clock.laps["round"] == pytest.approx(sum(clock.laps.values()))
    assert clock.laps["round"] >= 0.03
