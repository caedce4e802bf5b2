"""A simulated Rigol DS1000Z oscilloscope, from its programming guide.

Four inputs, memory depths and time bases of the series; one record at a time.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from sim_backend.plant.scope_source import Acquisition, Codes, Input, SampleSource
from sim_backend.serial_line.scpi import (
    Handler,
    ScpiError,
    ScpiParser,
    boolean,
    no_argument,
    number,
)
from tactile_lab.clock import Clock

_STEPS_A_DIVISION = 25
_REFERENCE = 127
_WIDE, _HALF_HIGH = 12, 4
_MOST_POINTS = 250_000
_SHIFT = 8


@dataclass
class _Channel:
    shown: bool = False
    scale: float = 1.0
    offset: float = 0.0
    coupling: str = "DC"
    probe: float = 10.0


@dataclass
class _Record:
    """One record around a forced trigger; nothing is sampled that is not kept.

    Attributes:
        acquisition: how it is sampled; its samples are counted from its start.
        armed: sample at which it was armed.
        before, after: samples before and from the trigger on.
        trigger: sample at which it triggered.
    """

    acquisition: Acquisition
    armed: int
    before: int
    after: int
    trigger: int | None = None
    codes: Codes | None = None

    def state(self, sample: int) -> str:
        """What the scope says of it once it has taken `sample` samples."""
        if self.trigger is None:
            return "WAIT" if sample >= self.armed + self.before else "RUN"
        return "STOP" if sample >= self.trigger + self.after else "TD"

    def force(self, sample: int) -> None:
        """Trigger at `sample`, or as soon after it as enough lies before."""
        if self.trigger is None:
            self.trigger = max(sample, self.armed + self.before)

    def read(self, source: SampleSource) -> Codes:
        """All its samples."""
        if self.codes is None:
            first = (self.trigger or 0) - self.before
            points = self.before + self.after
            self.codes, _ = source.render(self.acquisition, first, points)
        return self.codes


class SimulatedDs1000z:
    """The scope as its USBTMC interface sees it.

    Args:
        source: what lies at its inputs "1" to "4".
        clock: the time it lives in.
        sluggish: how many status questions after arming still tell of the last record.
        clock_error: relative error of its sample clock; 50e-6 is 50 ppm.
    """

    identity = "RIGOL TECHNOLOGIES,DS1104Z,DS1ZSIM0001,00.04.04"

    def __init__(
        self,
        source: SampleSource,
        clock: Clock,
        *,
        sluggish: int = 0,
        clock_error: float = 0.0,
    ) -> None:
        self.channels = {str(n): _Channel() for n in range(1, 5)}
        self.channels["1"].shown = True
        self._source, self._clock = source, clock
        self._timebase = 1e-6
        self._depth: int | None = None
        self._running = True
        self._sluggish, self._stale = sluggish, 0
        self._stretch = 1 + clock_error
        self._record: _Record | None = None
        self._acquisition: Acquisition | None = None
        self._reading = {"source": "1", "mode": "NORM", "form": "BYTE"}
        self._first, self._last = 1, 1200
        self.parser = ScpiParser(self._commands())

    def line(self, line: bytes) -> bytes | None:
        """The answer to one program message, or None."""
        if line.strip().upper() in (b":WAV:DATA?", b":WAVEFORM:DATA?"):
            return self._data()
        return self.parser.line(line)

    def _commands(self) -> dict[str, Handler]:
        table: dict[str, Handler] = {
            "*IDN?": lambda a: self.identity,
            "RUN": self._run,
            "STOP": self._stop,
            "SINGle": self._single,
            "TFORce": self._force,
            "TRIGger:STATus?": lambda a: self._status(),
            "TRIGger:MODE": lambda a: _word(a, {"EDGE": "EDGE"}) and None,
            "TRIGger:SWEep": lambda a: (
                _word(
                    a,
                    {"SING": "SING", "SINGLE": "SING", "AUTO": "AUTO", "NORM": "NORM"},
                )
                and None
            ),
            "TIMebase:MODE": lambda a: _word(a, {"MAIN": "MAIN"}) and None,
            "TIMebase[:MAIN]:SCALe": self._set_timebase,
            "TIMebase[:MAIN]:SCALe?": lambda a: f"{self._timebase:.6e}",
            "TIMebase[:MAIN]:OFFSet": self._set_delay,
            "ACQuire:TYPE": lambda a: _word(a, {"NORM": "N", "NORMAL": "N"}) and None,
            "ACQuire:MDEPth": self._set_depth,
            "ACQuire:MDEPth?": lambda a: str(self._depth or "AUTO"),
            "ACQuire:SRATe?": lambda a: f"{self._rate():.6e}",
            "WAVeform:SOURce": self._set_source,
            "WAVeform:MODE": self._set_mode,
            "WAVeform:FORMat": lambda a: _word(a, {"BYTE": "BYTE"}) and None,
            "WAVeform:STARt": lambda a: self._bound("_first", a),
            "WAVeform:STOP": lambda a: self._bound("_last", a),
            "WAVeform:PREamble?": lambda a: self._preamble(),
        }
        for name in self.channels:
            table |= self._channel_commands(name)
        return table

    def _channel_commands(self, name: str) -> dict[str, Handler]:
        channel, head = self.channels[name], f"CHANnel{name}:"

        def show(argument: str) -> None:
            channel.shown = boolean(argument)

        def scale(argument: str) -> None:
            least = 1e-3 * channel.probe
            channel.scale = number(argument, least, 10 * channel.probe)

        def offset(argument: str) -> None:
            most = (100 if channel.scale >= 0.5 * channel.probe else 2) * channel.probe
            channel.offset = number(argument, -most, most)

        def couple(argument: str) -> None:
            channel.coupling = _word(argument, {"AC": "AC", "DC": "DC"})

        def probe(argument: str) -> None:
            ratio = number(argument, 0.01, 1000)
            # the scale is kept in divisions at the tip
            channel.scale *= ratio / channel.probe
            channel.probe = ratio

        return {
            f"{head}DISPlay": show,
            f"{head}SCALe": scale,
            f"{head}SCALe?": lambda a: f"{channel.scale:.6e}",
            f"{head}OFFSet": offset,
            f"{head}OFFSet?": lambda a: f"{channel.offset:.6e}",
            f"{head}COUPling": couple,
            f"{head}PROBe": probe,
        }

    def _shown(self) -> list[str]:
        return [name for name, channel in self.channels.items() if channel.shown]

    def _depths(self) -> tuple[int, ...]:
        share = {0: 1, 1: 1, 2: 2}.get(len(self._shown()), 4)
        return tuple(n // share for n in (12_000, 120_000, 1_200_000, 12_000_000,
                                          24_000_000))  # fmt: skip

    def _points(self) -> int:
        return self._depth or self._depths()[0]

    def _rate(self) -> float:
        fastest = 1e9 / {0: 1, 1: 1, 2: 2}.get(len(self._shown()), 4)
        return min(fastest, self._points() / (_WIDE * self._timebase))

    def _set_timebase(self, argument: str) -> None:
        wanted = number(argument, 5e-9, 50)
        exponent = math.floor(math.log10(wanted) + 1e-9)
        steps = [m * 10.0**exponent for m in (1, 2, 5, 10)]
        self._timebase = min(steps, key=lambda step: abs(step - wanted))

    def _set_delay(self, argument: str) -> None:
        number(argument, 0, 0)

    def _set_depth(self, argument: str) -> None:
        if not self._running:
            raise ScpiError(-221, "Settings conflict")  # only while it runs
        if argument.upper() == "AUTO":
            self._depth = None
            return
        depth = int(number(argument, 1, 1e9))
        if depth not in self._depths():
            raise ScpiError(-224, "Illegal parameter value")
        self._depth = depth

    def _run(self, argument: str) -> None:
        no_argument(argument)
        self._running, self._record = True, None

    def _stop(self, argument: str) -> None:
        no_argument(argument)
        self._running = False

    def _single(self, argument: str) -> None:
        no_argument(argument)
        self._running, self._stale = True, self._sluggish
        inputs = tuple(
            Input(
                name,
                channel.scale * _HALF_HIGH * 1.27,
                channel.offset,
                channel.coupling,
            )
            for name, channel in self.channels.items()
            if channel.shown
        )
        points = self._points()
        # the converter reaches a little beyond the screen: 127 codes of 25 a division
        new = Acquisition(
            inputs, 1 / self._rate(), self._clock.now(), 127 << _SHIFT, _SHIFT
        )
        old = self._acquisition
        if old is None or replace(new, started=old.started) != old:
            self._acquisition = old = new
        self._record = _Record(
            old, self._sample(old), before=points // 2, after=points - points // 2
        )

    def _force(self, argument: str) -> None:
        no_argument(argument)
        if self._record is not None:
            self._record.force(self._sample(self._record.acquisition))

    def _sample(self, acquisition: Acquisition) -> int:
        """Samples taken by now."""
        elapsed = self._clock.now() - acquisition.started
        return math.floor(elapsed / (acquisition.interval * self._stretch) + 1e-6)

    def _status(self) -> str:
        record = self._record
        if self._stale > 0:
            self._stale -= 1
            return "STOP"
        if record is None:
            return "AUTO" if self._running else "STOP"
        state = record.state(self._sample(record.acquisition))
        self._running = state != "STOP"
        return state

    def _set_source(self, argument: str) -> None:
        names = {f"CHAN{n}": n for n in self.channels}
        names |= {f"CHANNEL{n}": n for n in self.channels}
        self._reading["source"] = _word(argument, names)

    def _set_mode(self, argument: str) -> None:
        modes = {"NORM": "NORM", "NORMAL": "NORM", "RAW": "RAW"}
        self._reading["mode"] = _word(argument, modes)

    def _bound(self, which: str, argument: str) -> None:
        setattr(self, which, int(number(argument, 1, self._points())))

    def _preamble(self) -> str:
        channel = self.channels[self._reading["source"]]
        step = channel.scale / _STEPS_A_DIVISION
        origin = round(channel.offset / step)
        interval = 1 / self._rate()
        points = self._points()
        mode = 2 if self._reading["mode"] == "RAW" else 0
        start = -points / 2 * interval
        return (
            f"0,{mode},{points},1,{interval:.6e},{start:.6e},0,{step:.6e},{origin},"
            f"{_REFERENCE}"
        )

    def _data(self) -> bytes | None:
        record, count = self._record, self._last - self._first + 1
        name = self._reading["source"]
        if (
            record is None
            or self._running
            or self._reading["mode"] != "RAW"
            or not 1 <= count <= _MOST_POINTS
            or not self.channels[name].shown
        ):
            self.parser.push(-221, "Settings conflict")
            return b"#9000000000"
        codes = record.read(self._source)
        row = [setting.name for setting in record.acquisition.inputs].index(name)
        part = codes[row, self._first - 1 : self._last]
        raw = ((part >> _SHIFT) + _REFERENCE).astype(np.uint8).tobytes()
        return b"#9%09d" % len(raw) + raw


def _word(argument: str, words: dict[str, str]) -> str:
    try:
        return words[argument.upper()]
    except KeyError:
        raise ScpiError(-224, "Illegal parameter value") from None
