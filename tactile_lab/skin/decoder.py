"""How well a plain decoder tells touches apart, and how their spikes code them."""

from __future__ import annotations

from dataclasses import dataclass
from importlib.util import find_spec
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tactile_lab.analysis.estimate import Estimate
from tactile_lab.arrays import FloatArray
from tactile_lab.errors import NotFoundError
from tactile_lab.skin.dataset import DURATION, LABELS, Dataset, touch
from tactile_lab.skin.single import simulate_taxel

SHUFFLES = 50
"""Times that labels are dealt anew, for what chance makes of the information."""
COMPARED = 40
"""Test touches whose trains are compared with one another."""
MEMORY = 0.05
"""Time constant of the distances between trains, s."""
GRID = 1e-3
"""At which the supply current is summed up, s."""


@dataclass(frozen=True)
class Coding:
    """What the spikes of one task tell.

    Attributes:
        score: share of test touches told right, with Wilson's 95 % interval.
        chance: share that guessing gets right.
        information: of a spike on the label by the taxel it comes from, bits, beyond
            what shuffled labels give; 0 where these give as much.
        shuffled: the spread of that under shuffled labels, one standard deviation.
        taxel: the one whose trains are compared: it fires most.
        victor_purpura: its mean distance between touches of one label, over that
            between labels.
        van_rossum: the same.
        spikes: mean number a touch.
    """

    score: Estimate
    chance: float
    information: float
    shuffled: float
    taxel: int
    victor_purpura: float
    van_rossum: float
    spikes: float


def require_libraries() -> None:
    """Refuse before anything is computed.

    Raises:
        NotFoundError: scikit-learn or elephant is missing.
    """
    if not (find_spec("sklearn") and find_spec("elephant")):
        raise NotFoundError(
            "A data set is scored with scikit-learn and elephant. In the checkout: "
            "pip install -e '.[dataset]'."
        )


def features(data: Dataset, touches: NDArray[np.intp]) -> FloatArray:
    """Counts, then first-spike latencies of all taxels, shape (touches, 2 taxels)."""
    return np.hstack([data.counts(touches), data.latencies(touches)])


def score(data: Dataset, task: str) -> Estimate:
    """Logistic regression on standardized features, scikit-learn's defaults."""
    from sklearn.linear_model import LogisticRegression
    from sklearn.pipeline import make_pipeline
    from sklearn.preprocessing import StandardScaler

    known, asked = data.chosen(task, test=False), data.chosen(task, test=True)
    decoder = make_pipeline(StandardScaler(), LogisticRegression(max_iter=5000))
    decoder.fit(features(data, known), data.label[known])
    right = decoder.predict(features(data, asked)) == data.label[asked]
    return Estimate.share(int(right.sum()), right.size)


def information(counts: FloatArray, label: NDArray[Any]) -> float:
    """Bits a spike tells of the label by the taxel it comes from.

    Of each taxel sum p (r/R) log2(r/R) over labels of probability p, r its rate under a
    label and R its mean (Skaggs, McNaughton, Gothard and Markus, NIPS 5, 1030, 1993),
    weighted by its spikes.
    """
    kinds = np.unique(label)
    p = np.array([np.mean(label == kind) for kind in kinds])
    rate = np.array([counts[label == kind].mean(axis=0) for kind in kinds])
    mean = p @ rate
    if not mean.sum():
        return 0.0
    part = rate / np.where(mean > 0, mean, 1.0)
    bits = p @ (part * np.log2(np.where(part > 0, part, 1.0)))
    return float(bits @ mean / mean.sum())


def beyond_chance(
    counts: FloatArray, label: NDArray[Any], seed: int
) -> tuple[float, float]:
    """`information` less its mean under shuffled labels, and its spread under these.

    Bits; 0 where shuffled labels tell as much: no information is negative.
    """
    drawn = np.random.default_rng(seed)
    chance = [information(counts, drawn.permutation(label)) for _ in range(SHUFFLES)]
    told = information(counts, label) - float(np.mean(chance))
    return max(told, 0.0), float(np.std(chance))


def coding(data: Dataset, task: str) -> Coding:
    """All measures of one task, of its test touches unless said."""
    asked = data.chosen(task, test=True)
    counts, label = data.counts(asked), data.label[asked]
    told, shuffled = beyond_chance(counts, label, data.seed)
    taxel = int(counts.sum(axis=0).argmax())
    some = asked[:COMPARED]
    apart = distances([data.train(int(i), taxel) for i in some])
    same = data.label[some][:, None] == data.label[some]
    pairs = ~np.eye(some.size, dtype=bool)
    ratios = [
        float(one[same & pairs].mean() / max(one[~same].mean(), 1e-300))
        if (same & pairs).any() and (~same).any()
        else float("nan")
        for one in apart
    ]
    return Coding(
        score=score(data, task),
        chance=1 / len(LABELS[task]),
        information=told,
        shuffled=shuffled,
        taxel=taxel,
        victor_purpura=ratios[0],
        van_rossum=ratios[1],
        spikes=float(counts.sum(axis=1).mean()),
    )


def distances(trains: list[FloatArray]) -> tuple[FloatArray, FloatArray]:
    """Victor and Purpura's and van Rossum's distance of each pair, by elephant."""
    import quantities as pq
    from elephant.spike_train_dissimilarity import (
        van_rossum_distance,
        victor_purpura_distance,
    )
    from neo import SpikeTrain

    made = [SpikeTrain(one * pq.s, t_stop=DURATION * pq.s) for one in trains]
    return (
        np.asarray(victor_purpura_distance(made, 1 / (MEMORY * pq.s))),
        np.asarray(van_rossum_distance(made, MEMORY * pq.s)),
    )


def energy_per_spike(data: Dataset) -> tuple[float | None, float]:
    """What the supply V_S gives a spike, J, and the share of it drawn at rest too.

    None where there is no spike to share it.

    V_S ((V_S - V_C1)/R1 + I_C), summed up over the first touch of each task by all
    taxels: the current through R1 and through T1. Followers, and what the firing stage
    draws beside the charge of C2, are not in the model.
    """
    spent = rest = 0.0
    spikes = 0
    at = np.linspace(0.0, DURATION, round(DURATION / GRID) + 1)
    for task in LABELS:
        skin = touch(data.seed, task, 0)
        for taxel in range(skin.array.size):
            circuit = skin.circuit_of(taxel)
            found = simulate_taxel(skin, taxel, keep=("spikes", "V_C1", "I_C"))
            current = (circuit.V_S - found.sample("V_C1", at)) / circuit.R1
            current += found.sample("I_C", at)
            spent += circuit.V_S * float(np.trapezoid(current, at))
            rest += circuit.V_S * float(current[0]) * DURATION
            spikes += 0 if found.spike_times is None else found.spike_times.size
    return spent / spikes if spikes else None, rest / spent
