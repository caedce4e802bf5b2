"""Where a run would not be what its scene asks for, and what its numbers rest on."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator

from tactile_lab.analysis.noise import MAINS
from tactile_lab.instruments.dialects import load_dialect
from tactile_lab.instruments.registry import scope_capability
from tactile_lab.instruments.serial_dialect import SerialDialect
from tactile_lab.magnetics import A2_PRINTED
from tactile_lab.planning.clocks import clocks
from tactile_lab.planning.computing import Computing
from tactile_lab.planning.estimate import Cost, resolution
from tactile_lab.planning.needs import Needs
from tactile_lab.planning.timeline import Timeline
from tactile_lab.planning.ways import ways_used
from tactile_lab.quantity import bytes_text, rounded, show
from tactile_lab.scene.scene import Scene
from tactile_lab.scene.tables import Simulated
from tactile_lab.signals import MODEL_ONLY
from tactile_lab.spikes.detection import DEVIATIONS

SAMPLES_PER_DECAY = 6
"""Samples per time constant of a spike from which its amplitude can be read."""

SLOW = frozenset({"V_C1", "I_DS", "coil_current", "field"})
"""Signals that nothing makes faster than node A and the coil."""
SAMPLES_PER_NODE_A = 50
"""Samples per time constant of node A from which V_C1 is seen whole."""

LOOSE = r"(?i)/dev/(tty(USB|ACM)|cu\.usb)|COM\d"
"""Ports whose names are given in the order of plugging in."""

NAME = 40
"""Characters of an instrument's answer to *IDN?, about the longest of its answers."""

FINE = 0.01
"""Largest part of the expected field that one code of its channel should be."""


def warnings(scene: Scene, needed: Needs, drive: Timeline) -> tuple[str, ...]:
    """What a person should change, or know, before a run; no scene has one for good."""
    return (
        *drive.warnings,
        *_model_only(scene),
        *_ways(scene, drive),
        *_spike_sampling(scene, needed),
        *_spikes_cut(scene, needed),
        *_noise(scene, needed, drive.streamed),
        *_scope(scene, needed),
        *_shunt(needed, drive),
        *_field(scene, needed, drive),
        *(() if scene.bench.simulated else _magnet(scene)),
        *_exchanged(scene, needed),
        *_slow_links(scene, needed),
    )


def _model_only(scene: Scene) -> Iterator[str]:
    for name in scene.record.signals:
        if name in MODEL_ONLY:
            yield (
                f"{name} exists only in the model; a run leaves it out. "
                "`tactile-lab simulate` gives it."
            )


def _ways(scene: Scene, drive: Timeline) -> Iterator[str]:
    for used in ways_used(drive.steps):
        if used.part > scene.force_accuracy:
            yield (
                f"no way of this bench brings the force nearer than "
                f"{rounded(100 * used.part)} % of its range, "
                f"{show(used.error, 'N', 2)}; "
                f"{rounded(100 * scene.force_accuracy)} % are wanted. Ask for a slower "
                "force, or allow more by [coil] accuracy."
            )


def _opened(needed: Needs) -> set[str]:
    """Names of the tables of instruments behind a port that a run opens."""
    asked = {
        "coil": needed.coil,
        "field_meter": needed.field_meter,
        "thermometer": needed.thermometer,
    }
    sources = (f"voltage_source.{name}" for name in needed.voltages)
    return {*(name for name, opens in asked.items() if opens), *sources}


def _slow_links(scene: Scene, needed: Needs) -> Iterator[str]:
    """Instruments whose name takes longer on the wire than is waited for it."""
    opened = _opened(needed)
    for name, spec in scene.bench.wired_by_port.items():
        if name not in opened or spec.driver != "serial":
            continue
        row = load_dialect(spec.dialect)
        if not isinstance(row, SerialDialect):
            continue
        wire = row.serial.at(spec.baud)
        waits, takes = spec.timeout or wire.timeout, NAME * wire.character_time
        if takes > waits:
            yield (
                f"[{name}] {wire.baud} baud: {NAME} characters, as an instrument's "
                f"name has, take {show(takes, 's', 2)}, and {show(waits, 's', 2)} are "
                f'waited for an answer. Write timeout = "{2 * takes:.1g} s" there, or '
                "use a faster link."
            )


def _exchanged(scene: Scene, needed: Needs) -> Iterator[str]:
    """Instruments that would take each other's place if their ports' names changed."""
    bench = scene.bench
    if bench.simulated:
        return
    opened = _opened(needed)
    alike: dict[str, list[str]] = {}
    for name, spec in bench.wired_by_port.items():
        if spec.driver == "serial":
            alike.setdefault(load_dialect(spec.dialect).match, []).append(name)
    for names in alike.values():
        found = [(name, bench.wired_by_port[name]) for name in names]
        bare = any(
            name in opened and not spec.serial and re.match(LOOSE, spec.port)
            for name, spec in found
        )
        if len(names) > 1 and bare:
            tables = " and ".join(f"[{name}]" for name in names)
            yield (
                f"{tables} are instruments of one kind, at ports whose names change "
                "when cables are pulled: exchanged, nothing would tell them apart. "
                'Write serial = "..." into each, as `tactile-lab devices` shows it, or '
                "name them by /dev/serial/by-id."
            )


def spike_width(scene: Scene) -> float:
    """Time a spike stays above the threshold, s; 0 if it never reaches it."""
    return scene.spike_width(threshold_of(scene))


def _height(scene: Scene) -> float:
    """How high V_K rises at a spike as the scope sees it, V."""
    return 0.0 if scene.spike is None else scene.spike.peak


def misses_spikes(scene: Scene, needed: Needs) -> bool:
    """Whether a spike fits between two samples of V_K, where they are looked for."""
    if needed.detect_on != "V_K":
        return False
    rate = scene.record.sample_rate
    return not scene.shows_spikes(threshold_of(scene), rate)


def threshold_of(scene: Scene) -> float:
    """Threshold on V_K, V; where noise decides it, the value that is expected.

    A real channel is taken to have the noise of its converter alone, half a code.
    """
    threshold = scene.detect.threshold
    if not isinstance(threshold, str):
        return threshold
    scope = scene.bench.scope
    wired = scope.channels if scope is not None else ()
    step = max((resolution(scene, c) for c in wired if c.signal == "V_K"), default=0.0)
    if not scene.bench.simulated:
        return DEVIATIONS * step / 2
    noise, hum = scene.simulated.noise.get("V_K", 0.0), scene.simulated.hum
    # a deviation is told from the quartiles, which a sine has 0.71 of it from its mean
    return DEVIATIONS * max(math.hypot(noise, 1.05 * hum), step / 2)


def _spike_sampling(scene: Scene, needed: Needs) -> Iterator[str]:
    if needed.detect_on != "V_K":
        if needed.detect_on is not None:
            yield (
                f"no V_K is wired: spikes are found as resets of {needed.detect_on}, "
                f"within one sample, {show(1 / scene.record.sample_rate, 's', 2)}."
            )
        return
    rate, width = scene.record.sample_rate, spike_width(scene)
    interval = 1 / rate
    if width == 0:
        (wired,) = (c for c in needed.channels if c.signal == "V_K")
        height, code = _height(scene), resolution(scene, wired)
        advice = "Lower it."
        if height < code:
            advice = (
                f"One code of scope input {wired.input} is {show(code, 'V', 3)}: "
                "choose a smaller range for it, and a threshold that spikes reach."
            )
        yield (
            f"no spike is high enough: V_K rises to {show(height, 'V', 3)} behind its "
            f"follower, the threshold is {show(threshold_of(scene), 'V')}. {advice}"
        )
    elif misses_spikes(scene, needed):
        yield (
            f"V_K at {show(rate, 'S/s')} misses about "
            f"{100 * (1 - width / interval):.0f} % of the spikes: they stay above "
            f"{show(threshold_of(scene), 'V')} for {show(width, 's', 2)}, one sample "
            f"takes {show(interval, 's')}. Sample at "
            f"{show(_round_up(2 / width), 'S/s')} or faster."
        )


def _spikes_cut(scene: Scene, needed: Needs) -> Iterator[str]:
    """That spikes are higher than their channel sees; a sensor may always fire."""
    channel = next((c for c in needed.channels if c.signal == "V_K"), None)
    height = _height(scene)
    if channel is None or channel.coupling != "DC" or height <= channel.span[1]:
        return
    low, high = (show(end, "V") for end in channel.span)
    yield (
        f"V_K rises to {show(height, 'V', 3)} at a spike, scope input {channel.input} "
        f"sees {low} to {high}: it is cut off there, and heights of spikes are not "
        "told. Choose a larger range."
    )


def _amplitudes(scene: Scene, needed: Needs) -> Iterator[str]:
    """That spikes are counted and timed well, but not seen whole."""
    rate, decay = scene.record.sample_rate, scene.circuit.tau_K
    interval = 1 / rate
    if needed.detect_on == "V_K" and (
        decay / SAMPLES_PER_DECAY < interval <= spike_width(scene)
    ):
        yield (
            f"V_K at {show(rate, 'S/s')} gives counts and times to "
            f"±{show(interval, 's')}, not amplitudes: a spike decays in "
            f"{show(decay, 's', 2)}. Amplitudes need "
            f"{show(SAMPLES_PER_DECAY / decay, 'S/s', 2)}."
        )


def _noise(scene: Scene, needed: Needs, streamed: float) -> Iterator[str]:
    if not scene.bench.simulated or needed.detect_on != "V_K":
        return
    sigma, hum = scene.simulated.noise.get("V_K", 0.0), scene.simulated.hum
    threshold = threshold_of(scene)
    if 0 < hum and hum + 3 * sigma > threshold:
        cycles = MAINS[0] * streamed
        yield (
            f"mains hum of {show(hum, 'V')} and noise of {show(sigma, 'V')} on V_K "
            f"reach the threshold of {show(threshold, 'V')} in up to {cycles:.3g} "
            "cycles of the mains, and add a spike or more in each. Raise the "
            'threshold, or set detect.threshold = "auto".'
        )
        return
    if sigma <= 0:
        return
    above = 0.5 * math.erfc(threshold / sigma / math.sqrt(2))
    expected = above * scene.record.sample_rate * streamed
    if expected > 0.5:
        yield (
            f"noise of {show(sigma, 'V')} on V_K reaches the threshold of "
            f"{show(threshold, 'V')} about {float(f'{expected:.2g}'):,.12g} times "
            "and adds spikes. Raise the threshold."
        )


def _scope(scene: Scene, needed: Needs) -> Iterator[str]:
    rate = scene.record.sample_rate
    if rate > needed.guaranteed_rate:
        yield (
            f"{show(rate, 'S/s')} on {len(needed.channels)} channels is beyond the "
            f"{show(needed.guaranteed_rate, 'S/s')} guaranteed on any USB port; the "
            "run ends as faulted if samples are lost."
        )
    if not needed.gapless:
        yield (
            "this scope is blind while it hands a record over: there are gaps between "
            "its records, which stay open in all that shows or exports them."
        )


def _shunt(needed: Needs, drive: Timeline) -> Iterator[str]:
    """Where the coil current leaves its channel, which the model does not have."""
    channel = next((c for c in needed.channels if c.signal == "coil_current"), None)
    if channel is None:
        return
    levels = [step.current.value for step in drive.steps if step.current is not None]
    low, high = channel.span
    least = min((float(one.min()) for one in levels), default=0.0)
    most = max((float(one.max()) for one in levels), default=0.0)
    if least < low or most > high:
        yield (
            f"the coil current will be {show(least, 'A')} to {show(most, 'A')}, scope "
            f"input {channel.input} sees {show(low, 'A')} to {show(high, 'A')}: beyond "
            "that it is cut off, and dates no steps. Choose a larger range."
        )


def _field(scene: Scene, needed: Needs, drive: Timeline) -> Iterator[str]:
    channel = next((c for c in needed.channels if c.signal == "field"), None)
    if channel is None or drive.current is None:
        return
    peak = drive.current.peak
    field = float(abs(scene.bench.magnet.field([-peak, peak])).max())
    low, high = channel.span
    if min(-low, high) < field:
        yield (
            f"the field is expected to reach {show(field, 'T')}, scope input "
            f"{channel.input} sees {show(low, 'T')} to {show(high, 'T')}; the run ends "
            "as faulted where it is exceeded. Choose a larger range."
        )
    elif (step := resolution(scene, channel)) > FINE * field:
        yield (
            f"one code of the field channel is {show(step, 'T')}, more than "
            f"{FINE:.0%} of the {show(field, 'T')} expected. Choose a smaller range of "
            f"input {channel.input}, or of the teslameter."
        )


def _magnet(scene: Scene) -> Iterator[str]:
    magnet = scene.bench.magnet
    if magnet.by_geometry and math.isclose(magnet.A2, A2_PRINTED):
        yield (
            "A2 = 2.25e-3 m² is Table 1's value as printed; a 15 mm x 15 mm core has a "
            "tenth of it, and a tenth of the force. A balance tells (force_check)."
        )


def cheaper(
    scene: Scene, needed: Needs, cost: Cost, computing: Computing
) -> Iterator[str]:
    """Settings that cost less and give the same answer."""
    rate = scene.record.sample_rate
    enough = _round_up(SAMPLES_PER_NODE_A / scene.circuit.tau_A)
    streamed = {channel.signal for channel in needed.channels}
    if streamed and streamed <= SLOW and rate > enough and needed.detect_on is None:
        left = 1 - enough / rate
        seconds = left * computing.time.get("storing", 0.0)
        follows, wanted = show(scene.circuit.tau_A, "s", 2), show(enough, "S/s")
        yield (
            f"{', '.join(sorted(streamed))} at {wanted}, not {show(rate, 'S/s')}: node "
            f"A follows in {follows}; saves {bytes_text(left * cost.disk)} of disk and "
            f"{show(seconds, 's', 2)} of processor time "
            f'(record.sample_rate = "{wanted}")'
        )
    if needed.detect_on is not None and needed.detect_on in needed.stored:
        saved = bytes_text(cost.packed[needed.detect_on])
        yield (
            f"spikes are found as {needed.detect_on} streams: its samples need not be "
            f"stored to have them; saves {saved} of disk "
            f"(then they cannot be looked for again)"
        )


def _round_up(rate: float) -> float:
    """`rate` rounded up to 1, 2 or 5 times a power of ten."""
    power = 10.0 ** math.floor(math.log10(rate))
    return next(step * power for step in (1, 2, 5, 10) if step * power >= rate)


def assumptions(scene: Scene, needed: Needs, drive: Timeline) -> tuple[str, ...]:
    """What the numbers rest on, one line each."""
    bench, magnet = scene.bench, scene.bench.magnet
    per_ampere = f"{show(magnet.newtons_per_ampere, 'N', 4)} per ampere"
    used = magnet.calibration
    if magnet.by_geometry:
        field = (
            f"B2 = {show(magnet.B2_per_ampere, 'T')} per ampere"
            if used is None
            else f"B2 from the calibration {used.path.name}"
        )
        lines = [
            f"force from Eq. (2): r = {show(magnet.r, 'm')}, "
            f"A1 = {show(magnet.A1, 'm²')}, A2 = {show(magnet.A2, 'm²')}, "
            f"B1 = {show(magnet.B1, 'T')}, {field}: {per_ampere}"
        ]
    elif used is not None:
        lines = [f"force from the calibration {used.path.name}: {per_ampere}"]
    # on a real bench it is a warning: the core may be another than the printed one
    lines += _magnet(scene) if bench.simulated else ()
    lines += _amplitudes(scene, needed)
    lines += _followers(scene)
    if magnet.coil_lag or magnet.eddy_lag:
        known = _band(magnet.lag_uncertainty, "s")
        lines.append(
            f"lags: coil {show(magnet.coil_lag, 's')}, core "
            f"{show(magnet.eddy_lag, 's')}, together{known}"
        )
    lines += clocks(scene, needed, drive)
    if not bench.simulated:
        return tuple(lines)
    world = scene.simulated
    if bench.coil is not None:
        baud = f" at {bench.coil.baud} baud" if bench.coil.baud else ""
        lines.append(
            f"simulated source: {bench.coil.dialect}{baud}, wire and parse time pass"
        )
    lines += _irregular(world)
    noise = ", ".join(f"{name} {show(sd, 'V')}" for name, sd in world.noise.items())
    if world.hum:
        noise += f", and {show(world.hum, 'V')} of mains hum on every channel"
    codes = ""
    if needed.channels and bench.scope is not None:
        codes = f"; {scope_capability(bench.scope).bits}-bit codes"
    lines.append(f"noise (seed {world.seed}): {noise}{codes}")
    return tuple(lines)


def _followers(scene: Scene) -> Iterator[str]:
    followers = scene.bench.followers
    if followers is None:
        return
    bias, circuit = followers.input_bias, scene.circuit
    fast = (
        f"{show(followers.bandwidth, 'Hz')} and {followers.slew * 1e-6:g} V/µs"
        if followers.bandwidth
        else "infinitely fast"
    )
    yield (
        f"followers: input bias {show(bias, 'A')}"
        f"{_band(followers.input_bias_uncertainty, 'A')} shifts V_C2 by "
        f"{show(bias * circuit.R_L, 'V', 2)}; offset "
        f"±{show(followers.offset_uncertainty, 'V')}; {fast}"
    )


def _band(half: float | None, unit: str) -> str:
    """An uncertainty behind its value."""
    return " (not stated how well)" if half is None else f" ±{show(half, unit)} (95 %)"


def _irregular(world: Simulated) -> Iterator[str]:
    """What makes the simulated sensor irregular, where it is on."""
    parts = {
        "V_fire": (world.V_fire_noise, "V"),
        "V_GS": (world.V_GS_noise, "V"),
        "the coil's source": (world.current_noise, "A"),
        "mains on V_GS": (world.V_GS_hum, "V"),
    }
    told = [
        f"{name} {show(size, unit)}" for name, (size, unit) in parts.items() if size
    ]
    if told:
        yield f"noise of the sensor: {', '.join(told)}"
    if world.warming:
        become = "warmer" if world.warming > 0 else "colder"
        yield (
            f"the sensor becomes {show(abs(world.warming), 'K')} {become} than at the "
            f"begin, with a time constant of {show(world.warming_time, 's')}"
        )
    if world.specimen:
        yield (
            f"specimen {world.specimen}: R within 1 %, C within 5 %, V_GS within 2 mV, "
            "V_th within 5 mV (two standard deviations). What the run tells is of this "
            "specimen alone, the model beside it is of the parts as marked: the spread "
            "stands in no interval; a study over specimens tells it"
        )
