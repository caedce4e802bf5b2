"""The card of a benchmark data set: what it is, how made, how well decoded."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from string import Template

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
from tactile_lab.whole_file import write_text

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
    half = int(data.test.sum()) // len(LABELS)
    scores = (
        f"| {task} | {TOLD[task]} | {', '.join(LABELS[task])} | "
        f"{one.score.value:.1%} ({one.score.low:.1%} to {one.score.high:.1%}) | "
        f"{one.chance:.1%} |\n"
        for task, one in codings.items()
    )
    codes = (
        f"| {task} | {one.spikes:.1f} | {one.information:.3f} ± {one.shuffled:.3f} | "
        f"{one.victor_purpura:.2f} | {one.van_rossum:.2f} |\n"
        for task, one in codings.items()
    )
    spent, rest = energy
    told = (
        "no spikes to share what the supply V_S gives:"
        if spent is None
        else f"{show(spent, 'J', 3)} from the supply V_S for a spike, {rest:.0%} of "
        "which is drawn at rest as well:"
    )
    text = Template(Path(__file__).with_name("card.md").read_text("utf-8")).substitute(
        touches=f"{data.task.size:,}", duration=show(DURATION, "s"), half=half,
        taxels=data.places.shape[0], spikes=f"{data.time.size:,}", made=made,
        tasks=len(LABELS), scores="".join(scores), codes="".join(codes), energy=told,
        shuffles=SHUFFLES, compared=min(COMPARED, half), memory=show(MEMORY, "s"),
        cost=f"1/{MEMORY:g} s", file=FILE, array=ARRAY, sensor=SENSOR,
    )  # fmt: skip
    card = folder / "README.md"
    with recording():
        write_text(card, text)
    return card
