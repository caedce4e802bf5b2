"""Axes and designs: units, ranges, spreads, which points there are."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tactile_lab import load
from tactile_lab.errors import SceneError
from tactile_lab.studies.axes import Axis, Spread, axis
from tactile_lab.studies.design import Design, checked

SCENE = load("demo")


def test_a_range_takes_the_unit_of_its_key_and_includes_its_end() -> None:
    found = axis("sensor.V_GS", {"values": "1.38 V : 1.42 V : 10 mV"}, SCENE)
    assert found.unit == "V"
    assert found.values == pytest.approx((1.38, 1.39, 1.40, 1.41, 1.42), abs=1e-15)
    found = axis("protocol.levels", {"values": "180 mN:200 mN:20 mN"}, SCENE)
    assert (found.unit, found.values) == ("N", (0.18, 0.2)), "each a list of one"


def test_a_tolerance_is_of_what_the_scene_has() -> None:
    found = axis("sensor.R1", {"normal": "1 %"}, SCENE)
    assert found.spread == Spread("normal", 9.58e6, pytest.approx(9.58e4))
    found = axis("sensor.V_GS", {"uniform": ["1.39 V", "1.41 V"]}, SCENE)
    assert found.spread == Spread("uniform", 1.40, pytest.approx(0.01))


@pytest.mark.parametrize(
    ("key", "given", "told"),
    [
        ("sensor.R1", {"values": ["9 MV"]}, "Ohm is needed"),
        ("sensor.R1", {"values": "1 MOhm : 2 MOhm"}, "from : to : step"),
        ("sensor.R1", {"values": "2 MOhm : 1 MOhm : 1 MOhm"}, "leads away"),
        ("sensor.R1", {"values": "1 MOhm : 2 MOhm : 1 Ohm"}, "larger steps"),
        ("sensor.R1", {"values": []}, "none"),
        ("sensor.R1", {"normal": "0 %"}, "does not spread"),
        ("protocol.order", {"normal": "1 %"}, "of what"),
    ],
)
def test_what_cannot_be_read_is_refused(key: str, given: dict, told: str) -> None:
    with pytest.raises(SceneError, match=told) as refused:
        axis(key, given, SCENE)
    assert key in str(refused.value)


def grid(**sizes: int) -> tuple[Axis, ...]:
    return tuple(
        Axis(key=key, unit="", values=tuple(float(i) for i in range(size)))
        for key, size in sizes.items()
    )


@given(st.lists(st.integers(1, 4), min_size=1, max_size=3), st.integers(1, 3))
def test_every_combination_stands_once_for_each_repeat(
    sizes: list[int], repeat: int
) -> None:
    design = Design(axes=grid(**dict(zip("abc", sizes, strict=False))), repeat=repeat)
    every = range(design.size)
    seen = list(zip(design.values(every), design.repeats(every).tolist(), strict=True))
    assert len(set(seen)) == design.size == np.prod(sizes) * repeat


def test_axes_of_a_group_go_together() -> None:
    one, two = grid(a=3, b=3)
    pair = tuple(
        Axis(key=x.key, unit="", values=x.values, group="pair") for x in (one, two)
    )
    assert Design(axes=pair).values(range(3)) == [(0, 0), (1, 1), (2, 2)]
    uneven = (*pair, Axis(key="c", unit="", values=(1.0,), group="pair"))
    with pytest.raises(SceneError, match=r'zip = "pair".* a has 3, b has 3, c has 1'):
        _ = Design(axes=uneven).shape


@pytest.mark.parametrize("method", ["random", "latin hypercube", "sobol", "indices"])
def test_a_draw_is_the_same_whoever_asks_and_in_its_distribution(method) -> None:
    spread = Spread("normal", 5.0, 0.1), Spread("uniform", 0.0, 1.0)
    axes = tuple(Axis(key=f"k{i}", unit="", spread=s) for i, s in enumerate(spread))
    design = Design(axes=axes, draws=4096, method=method, seed=3)
    whole = np.array(design.values(range(design.size)))
    again = Design(axes=axes, draws=4096, method=method, seed=3)
    some = [700, 3, 511]
    assert np.array_equal(again.values(some), whole[some])
    assert not np.array_equal(
        Design(axes=axes, draws=4096, method=method, seed=4).values(some), whole[some]
    )
    assert whole[:, 0].mean() == pytest.approx(5.0, abs=0.01)
    assert whole[:, 0].std() == pytest.approx(0.1, rel=0.05)
    assert np.abs(whole[:, 1]).max() < 1.0


def test_a_tornado_moves_one_axis_at_a_time() -> None:
    axes = tuple(
        Axis(key=k, unit="", spread=Spread("normal", 0.0, 2.0)) for k in ("a", "b")
    )
    points = np.array(Design(axes=axes, method="tornado").values(range(5)))
    assert points == pytest.approx(
        np.array([[0, 0], [-2, 0], [2, 0], [0, -2], [0, 2]]), abs=1e-12
    )


def test_what_cannot_be_carried_out_is_refused() -> None:
    with pytest.raises(SceneError, match="stands twice"):
        checked(Design(axes=grid(a=2) + grid(a=2)))
    with pytest.raises(SceneError, match=r"10000 × 10000 = 1e\+08 points"):
        checked(Design(axes=grid(a=10_000, b=10_000)))
    drawn = (Axis(key="a", unit="", spread=Spread("normal", 0.0, 1.0)),)
    with pytest.raises(SceneError, match="power of two; take 1024"):
        checked(Design(axes=drawn, draws=1000, method="sobol"))
