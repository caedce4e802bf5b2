"""Design tokens: every colour of the window, once for light and once for dark.

Trace colours are Okabe-Ito hues shifted for contrast and checked for colour-vision
deficiency. Red is kept for a live coil's STOP, faults and delete; amber means
simulated or transitional; blue running or selected; green verified.
"""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, kw_only=True)
class Tokens:
    """Colours of one theme, as "#rrggbb"."""

    name: str
    page: str
    panel: str
    sunken: str
    field: str
    border: str
    border_strong: str
    text: str
    muted: str
    faint: str
    accent: str
    accent_hover: str
    on_accent: str
    selected: str
    selected_text: str
    red: str
    red_soft: str
    amber: str
    amber_soft: str
    green: str
    green_soft: str
    header: str
    header_chip: str
    header_border: str
    header_text: str
    header_muted: str
    plot: str
    grid: str
    band: str
    ahead: str
    force: str
    V_C1: str
    V_C2: str
    V_K: str
    rate: str
    spikes: str
    current: str
    twin: str
    residual: str
    run_a: str
    run_b: str
    run_c: str

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
            "residual": self.residual,
        }
        return known.get(signal, self.twin)

    @property
    def runs(self) -> tuple[str, str, str]:
        """Colours of compared runs A, B, C."""
        return self.run_a, self.run_b, self.run_c


LIGHT = Tokens(
    name="light",
    page="#EDF1F5",
    panel="#FFFFFF",
    sunken="#F4F6F9",
    field="#FFFFFF",
    border="#DCE2E9",
    border_strong="#B9C3CE",
    text="#16202B",
    muted="#566374",
    faint="#8B97A5",
    accent="#0B5FCC",
    accent_hover="#0950AD",
    on_accent="#FFFFFF",
    selected="#E2EEFC",
    selected_text="#0A53B3",
    red="#C4122F",
    red_soft="#FDE7EA",
    amber="#8F5B00",
    amber_soft="#FFF1D6",
    green="#14713F",
    green_soft="#E1F4E8",
    header="#111B28",
    header_chip="#1C2838",
    header_border="#33425A",
    header_text="#F3F6FA",
    header_muted="#A9B6C6",
    plot="#FFFFFF",
    grid="#E6EAEF",
    band="#F1F5FB",
    ahead="#F7F8FA",
    force="#0072B2",
    V_C1="#C84A00",
    V_C2="#00805C",
    V_K="#A9407E",
    rate="#5E35B1",
    spikes="#16202B",
    current="#4A6785",
    twin="#39485A",
    residual="#5B6B7C",
    run_a="#0072B2",
    run_b="#C84A00",
    run_c="#00805C",
)

DARK = Tokens(
    name="dark",
    page="#0A0F16",
    panel="#111924",
    sunken="#161F2C",
    field="#1A2433",
    border="#243040",
    border_strong="#3B4A5F",
    text="#E7EDF4",
    muted="#9DACBE",
    faint="#6F7F93",
    accent="#4C9BFF",
    accent_hover="#78B4FF",
    on_accent="#06121F",
    selected="#16355C",
    selected_text="#8CC0FF",
    red="#FF6B76",
    red_soft="#421B22",
    amber="#F0B04A",
    amber_soft="#3A2A0F",
    green="#4FD08A",
    green_soft="#123524",
    header="#080C12",
    header_chip="#141D29",
    header_border="#2B394C",
    header_text="#F3F6FA",
    header_muted="#A9B6C6",
    plot="#0E151F",
    grid="#1B2634",
    band="#13202F",
    ahead="#111A26",
    force="#56B4E9",
    V_C1="#FF8B4D",
    V_C2="#2FD1A0",
    V_K="#F08CC4",
    rate="#F4E04D",
    spikes="#E7EDF4",
    current="#9FB8D3",
    twin="#C9D3DE",
    residual="#93A4B7",
    run_a="#56B4E9",
    run_b="#FF8B4D",
    run_c="#2FD1A0",
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
