"""What the window is made of, for the parts that work on all of it."""

from __future__ import annotations

from dataclasses import dataclass, field

from gui.header.header import Header
from gui.header.stop import StopButton
from gui.look.theme import Theme
from gui.review.panel import ReviewPanel
from gui.screen.centre import Centre
from gui.session.session import Session
from gui.setup.panel import SetupPanel


@dataclass(frozen=True, eq=False)
class Panels:
    """The session and the panels that show it.

    Attributes:
        stops: every STOP there is; the header's is the first.
    """

    session: Session
    theme: Theme
    header: Header
    setup: SetupPanel
    centre: Centre
    review: ReviewPanel
    stops: list[StopButton] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.stops.append(self.header.stop)
