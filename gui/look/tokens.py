"""Design tokens: every colour of the window, once for light and once for dark.

Trace colours are Okabe-Ito hues shifted for contrast and checked for colour-vision
deficiency. Red is kept for a live coil's STOP, faults and delete; amber means
simulated or transitional; blue running or selected; green verified.
"""

from __future__ import annotations

from dataclasses import dataclass, field, fields
from typing import Any


def _both(light: str, dark: str) -> Any:
    """A colour as it is by day and by night."""
    return field(default=light, metadata={"dark": dark})


@dataclass(frozen=True, kw_only=True)
class Tokens:
    """Colours of one theme, as "#rrggbb"; the defaults are those of the light one."""

    name: str = "light"
    page: str = _both("#EDF1F5", "#0A0F16")
    panel: str = _both("#FFFFFF", "#111924")
    sunken: str = _both("#F4F6F9", "#161F2C")
    field: str = _both("#FFFFFF", "#1A2433")
    border: str = _both("#DCE2E9", "#243040")
    border_strong: str = _both("#B9C3CE", "#3B4A5F")
    control: str = _both("#7F8C9C", "#667992")
    text: str = _both("#16202B", "#E7EDF4")
    muted: str = _both("#566374", "#9DACBE")
    faint: str = _both("#8B97A5", "#6F7F93")
    accent: str = _both("#0B5FCC", "#4C9BFF")
    accent_hover: str = _both("#0950AD", "#78B4FF")
    on_accent: str = _both("#FFFFFF", "#06121F")
    selected: str = _both("#E2EEFC", "#16355C")
    selected_text: str = _both("#0A53B3", "#8CC0FF")
    red: str = _both("#C4122F", "#FF6B76")
    red_soft: str = _both("#FDE7EA", "#421B22")
    amber: str = _both("#8F5B00", "#F0B04A")
    amber_soft: str = _both("#FFF1D6", "#3A2A0F")
    green: str = _both("#14713F", "#4FD08A")
    green_soft: str = _both("#E1F4E8", "#123524")
    header: str = _both("#111B28", "#080C12")
    header_chip: str = _both("#1C2838", "#141D29")
    header_border: str = _both("#33425A", "#2B394C")
    header_text: str = _both("#F3F6FA", "#F3F6FA")
    header_muted: str = _both("#A9B6C6", "#A9B6C6")
    plot: str = _both("#FFFFFF", "#0E151F")
    grid: str = _both("#E6EAEF", "#1B2634")
    band: str = _both("#F1F5FB", "#13202F")
    ahead: str = _both("#F7F8FA", "#111A26")
    force: str = _both("#0072B2", "#56B4E9")
    V_C1: str = _both("#C84A00", "#FF8B4D")
    V_C2: str = _both("#00805C", "#2FD1A0")
    V_K: str = _both("#A9407E", "#F08CC4")
    rate: str = _both("#5E35B1", "#F4E04D")
    spikes: str = _both("#16202B", "#E7EDF4")
    current: str = _both("#4A6785", "#9FB8D3")
    twin: str = _both("#39485A", "#C9D3DE")
    residual: str = _both("#5B6B7C", "#93A4B7")
    run_a: str = _both("#0072B2", "#56B4E9")
    run_b: str = _both("#C84A00", "#FF8B4D")
    run_c: str = _both("#00805C", "#2FD1A0")

    def trace(self, signal: str) -> str:
        """Colour of a signal's trace."""
        known = {
            "force": self.force,
            "V_C1": self.V_C1,
            "V_C2": self.V_C2,
            "V_K": self.V_K,
            "rate": self.rate,
            "spikes": self.spikes,
            "coil_current": self.current,
            "field": self.current,
            "temperature": self.current,
            "residual": self.residual,
        }
        return known.get(signal, self.twin)

    @property
    def runs(self) -> tuple[str, str, str]:
        """Colours of compared runs A, B, C."""
        return self.run_a, self.run_b, self.run_c


LIGHT = Tokens()
DARK = Tokens(
    name="dark",
    **{one.name: one.metadata["dark"] for one in fields(Tokens) if one.metadata},
)

# What lies on the header is dark in both themes.
LAMP_GREEN = "#3DDC84"
LAMP_BLUE = "#5AA9FF"
LAMP_AMBER = "#F5A524"
LAMP_RED = "#FF6B76"
LAMP_GREY = "#8695A8"
STOP_RED = "#D01F34"
STOP_RED_PRESSED = "#A5142A"
STOP_DARK_RED = "#5E0A14"
HAZARD_YELLOW = "#FFD400"
HAZARD_BLACK = "#141414"
