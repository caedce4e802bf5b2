"""The card of a benchmark data set: what it is, how made, how well decoded."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from tactile_lab.quantity import show
from tactile_lab.skin.dataset import (
    ARRAY,
    DURATION,
    FILE,
    LABELS,
    SENSOR,
    Dataset,
)
from tactile_lab.skin.decoder import COMPARED, MEMORY, SHUFFLES, Coding
from tactile_lab.skin.events import recording

TOLD = {
    "press": "a ball of 5 mm radius presses: with which force? (drawn: 15 % more or "
    "less of it, the place)",
    "edge": "a straight ridge, 1.5 mm wide, presses: at which angle? (drawn: up to "
    "8 degrees of it, the place, the pressure)",
    "texture": "a rough plate slides by at 20 mm/s: how long are its waves? (drawn: "
    "the pattern, the direction, the pressure). Counts and first spikes hardly "
    "tell: it takes a decoder that looks at time or at the spread over taxels",
    "slip": "a ball presses: does it slip, at 10 mm/s? (drawn: when, which way, the "
    "force, the place)",
}


def write_card(
    folder: Path,
    data: Dataset,
    codings: Mapping[str, Coding],
    energy: tuple[float | None, float],
    made: str,
) -> Path:
    """Write `README.md` beside the touches.

    Args:
        folder: of the data set.
        data: what it holds.
        codings: of each task.
        energy: see `decoder.energy_per_spike`.
        made: by which command and version.

    Raises:
        RecordingError: it cannot be written.
    """
    touches, half = data.task.size, int(data.test.sum()) // len(LABELS)
    lines = [
        "# Touches on a skin of spiking sensors",
        "",
        f"{touches:,} touches of {show(DURATION, 's')} on one simulated skin of "
        f"{data.places.shape[0]} taxels, {data.time.size:,} spikes; in each of "
        f"{len(LABELS)} tasks {half} for training and {half} for test. {made}. The "
        "same seed gives the same spikes to the last bit.",
        "",
        "| task | question | answers | score | chance |",
        "|---|---|---|---|---|",
    ]
    for task, coding in codings.items():
        score = coding.score
        lines.append(
            f"| {task} | {TOLD[task]} | {', '.join(LABELS[task])} | "
            f"{score.value:.1%} ({score.low:.1%} to {score.high:.1%}) | "
            f"{coding.chance:.1%} |"
        )
    lines += [
        "",
        "Score: the share of test touches that logistic regression (scikit-learn, its "
        "defaults, on standardized features) tells right from the number of spikes "
        "and the time of the first one of each taxel (the duration where there is "
        f"none), trained on the training part; in brackets Wilson's 95 % interval for "
        f"{half} touches.",
        "",
        "| task | spikes a touch | information a spike (bit) | Victor-Purpura | "
        "van Rossum |",
        "|---|---|---|---|---|",
    ]
    for task, coding in codings.items():
        lines.append(
            f"| {task} | {coding.spikes:.1f} | {coding.information:.3f} "
            f"± {coding.shuffled:.3f} | {coding.victor_purpura:.2f} | "
            f"{coding.van_rossum:.2f} |"
        )
    spent, rest = energy
    told = (
        "no spikes to share what the supply V_S gives:"
        if spent is None
        else f"{show(spent, 'J', 3)} from the supply V_S for a spike, {rest:.0%} of "
        "which is drawn at rest as well:"
    )
    lines += [
        "",
        "Information: what a spike tells of the answer by the taxel it comes from, "
        "after Skaggs and others (1993), from mean counts of the test part, less the "
        f"mean under {SHUFFLES} shuffles of the answers (0 where these tell as much); "
        "± is one standard deviation under these. What time tells is not in it.",
        "",
        "Distances (elephant): the mean between touches of one answer over the mean "
        f"between answers, of the first {min(COMPARED, half)} test touches, by the "
        "trains of the taxel that fires most; time constant "
        f"{show(MEMORY, 's')} (a cost of 1/{MEMORY:g} s). 1: these trains tell "
        "nothing.",
        "",
        f"Energy: {told} V_S ((V_S - V_C1)/R1 + I_C), summed up over "
        "the first touch of each task and all taxels. Voltage followers and what the "
        "firing stage draws beside the charge of C2 are not in the model.",
        "",
        "## Files",
        "",
        f"`{FILE}` (HDF5): `time` (s) and `taxel` of every spike; `first`: touch i has "
        "the spikes from `first[i]` to `first[i + 1]`; `task`, `label` and `test` of "
        "every touch, numbered as in the attribute `labels`; `places` of the taxels "
        "(m).",
        "",
        "```python",
        "from tactile_lab.skin.dataset import Dataset",
        "",
        'data = Dataset.read("FOLDER")',
        'touches = data.chosen("edge", test=False)',
        "data.counts(touches), data.latencies(touches), data.label[touches]",
        "```",
        "",
        "## How it was made",
        "",
        f"Simulated: array {ARRAY}, sensor {SENSOR} beside Table 1, every taxel a "
        "specimen of its own; contact mechanics and the force's straight pieces as in "
        "docs/skin.md; spike times to 1 ns for that force. No noise of instruments, "
        "no friction, no skin that ages: scores on a real skin will be lower. Training "
        "and test touch the same skin, so they do not tell how a decoder fares on "
        "another one; for that, make a data set of another seed.",
        "",
    ]
    card = folder / "README.md"
    with recording():
        card.write_text("\n".join(lines), encoding="utf-8")
    return card
