"""Who reads the teslameter for `run`: the person at the terminal, or a file of his."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from tactile_lab.errors import QuantityError, SceneError

if TYPE_CHECKING:
    from tactile_lab.acquisition.asked_field import AskedField
    from tactile_lab.acquisition.person import Question
    from tactile_lab.scene.scene import Scene


def field_reader(
    scene: Scene, person: Question | None, path: Path | None
) -> AskedField | None:
    """Whoever tells what the teslameter shows; None where nobody does.

    Raises:
        SceneError: the file does not fit the scene.
    """
    from tactile_lab.acquisition.asked_field import AskedField

    ask = person if path is None else readings(path, scene)
    if ask is None:
        return None
    magnet = scene.bench.magnet
    return AskedField(
        ask, lambda current: float(magnet.field(current)), patient=path is None
    )


def readings(path: Path, scene: Scene) -> Question:
    """Answers with one line of the file after another.

    Args:
        path: one reading a line, mT or with a unit; empty lines and `#` count for
            nothing.
        scene: asks for one reading at each hold.

    Raises:
        SceneError: the file cannot be read, a line is no field, or there are not as
            many as holds are planned, or nobody is to read the field.
    """
    from tactile_lab.acquisition.asked_field import read_off
    from tactile_lab.instruments.registry import BY_PERSON
    from tactile_lab.planning.needs import needs
    from tactile_lab.planning.timeline import timeline

    drive = timeline(scene, through_coil=True)
    if not needs(scene, drive).asked_field:
        meter = scene.bench.field_meter
        remedy = 'Give the bench a teslameter with [field_meter] driver = "manual"'
        if meter is not None and meter.driver == BY_PERSON:
            remedy = 'Write "field" into record.signals'
        raise SceneError(
            f"--field {path}: {scene.name} has nobody read the field. {remedy}, or "
            "leave --field out."
        )
    try:
        text = path.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as reason:
        raise SceneError(f"Readings {path} cannot be read: {reason}.") from reason
    lines = []
    for number, line in enumerate(text.splitlines(), start=1):
        if not (told := line.partition("#")[0].strip()):
            continue
        try:
            read_off(told)
        except QuantityError as reason:
            raise SceneError(f"{path}, line {number}: {reason}") from reason
        lines.append(told)
    holds = sum(
        1 for s in drive.steps if s.trial.hold is not None and not s.trial.pause
    )
    if len(lines) != holds:
        raise SceneError(
            f"{path} has {len(lines)} readings; {scene.name} asks for {holds}, one at "
            "each hold."
        )
    answers = iter(lines)
    return lambda _: next(answers)
