import json
import re
from dataclasses import replace
from html.parser import HTMLParser
from pathlib import Path

import numpy as np
import pytest

from protocols.hold import Hold
from tactile_lab.conclusion import Table
from tactile_lab.magnetics import ForceUncertainty
from tactile_lab.measurement import MeasuredTrial
from tactile_lab.model.circuit import Circuit
from tactile_lab.plot import spike_train
from tactile_lab.report.findings import find
from tactile_lab.report.from_run import sensor_texts
from tactile_lab.report.html import rendered
from tactile_lab.report.overview import overview
from tactile_lab.report.page import page
from tactile_lab.report.splice import stretches
from tactile_lab.report.table import trials_table
from tactile_lab.report.write import write
from tactile_lab.scene.load import load
from tactile_lab.waveform import Waveform


class Outline(HTMLParser):
    """Tags that stand open, and everything that would be fetched."""

    void = ("meta", "link", "img", "br", "hr", "wbr")

    def __init__(self):
        super().__init__()
        self.open, self.fetched, self.tags, self.text = [], [], set(), []

    def handle_starttag(self, tag, attrs):
        self.tags.add(tag)
        if tag not in self.void:
            self.open.append(tag)
        for name, value in attrs:
            if name in ("src", "href", "xlink:href") and not value.startswith("#"):
                self.fetched.append(value)

    def handle_startendtag(self, tag, attrs):
        self.tags.add(tag)

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def handle_data(self, data):
        self.text.append(data)


@pytest.fixture(scope="module")
def written(demo, tmp_path_factory):
    return write(tmp_path_factory.mktemp("run"), demo, pdf=True)


def test_it_writes_figure_page_and_numbers(written):
    assert written.png.read_bytes().startswith(b"\x89PNG")
    assert written.svg.read_text().count("<svg") == 1
    assert written.png.with_suffix(".pdf").read_bytes().startswith(b"%PDF")
    assert written.html.exists()


def test_the_page_is_whole_and_fetches_nothing(written):
    outline = Outline()
    outline.feed(written.html.read_text(encoding="utf-8"))
    assert outline.open == []
    assert outline.fetched == []
    assert "script" not in outline.tags
    assert not re.search(r"url\((?!#)", written.html.read_text(encoding="utf-8"))


def test_the_page_says_what_a_reader_must_know(written, demo):
    outline = Outline()
    outline.feed(written.html.read_text(encoding="utf-8"))
    text = " ".join(outline.text)
    for wanted in (
        "Simulated bench", "72,000,000", "not identifiable", demo.warnings[0],
        demo.assumptions[0], demo.accuracy, "KEPCO,BIT 4886", "163 mT", "V_GS",
        "Eq. (16)", "complete",
    ):  # fmt: skip
        assert wanted in text


def test_figures_of_the_page_follow_light_and_dark(written):
    page = written.html.read_text(encoding="utf-8")
    inline = page[page.index("<svg") : page.index("</svg>")]
    assert "var(" not in inline, "which not every program that prints understands"
    dark = page[page.index("@media screen and (prefers-color-scheme:dark)") :]
    drawn = set(re.findall(r"\b(fill|stroke): (#[0-9a-f]{6})", inline))
    assert ("stroke", "#c84a00") in drawn
    for what, colour in drawn:
        assert f'svg [style*="{what}: {colour}"]{{{what}:#' in dark


def test_a_measured_run_is_marked_as_measured(demo, tmp_path):
    report = write(tmp_path, replace(demo, simulated=False))
    page = report.html.read_text(encoding="utf-8")
    assert 'class="mark measured">Measured' in page
    assert 'class="mark simulated"' not in page
    assert json.loads(report.results.read_text())["simulated"] is False


def test_results_json_holds_every_number_exactly(written, demo):
    found = json.loads(written.results.read_text(encoding="utf-8"))
    assert found["spikes"] == sum(t.spike_times.size for t in demo.trials)
    assert found["loss"]["samples"] == 0
    for trial, asked in zip(found["trials"], demo.trials, strict=True):
        assert trial["spike_times_s"] == asked.spike_times.tolist()
        assert trial["level_N"] == asked.level
    silent = found["trials"][0]
    assert silent["latency_s"] is None
    assert silent["adaptation_why_not"] == "no spikes"


def test_every_key_of_results_json_is_documented(written):
    text = (Path(__file__).parents[2] / "docs" / "json.md").read_text(encoding="utf-8")
    page = text[text.index("results.json") :]
    found = json.loads(written.results.read_text(encoding="utf-8"))
    for key in (*found, *found["trials"][0]):
        assert f"`{key}`" in page, key


def test_text_of_others_cannot_break_the_page(demo, tmp_path):
    hostile = replace(
        demo, title="<b>&", warnings=("<script>alert(1)</script>",), scene='"><i>'
    )
    page = write(tmp_path, hostile).html.read_text(encoding="utf-8")
    assert "<script" not in page
    outline = Outline()
    outline.feed(page)
    assert outline.open == []


def test_settings_are_told_with_their_units_as_people_write_them(demo, tmp_path):
    told = {"compliance_V": "14", "update_interval_s": "0.0454688", "output": ""}
    coil = {
        "coil": told | {"ramps": "False", "A2": "2250 mm^2", "set_by_hand_s": "by hand"}
    }
    coil["coil"]["k_F"] = "1.5297506925207756 V/N"
    page = write(tmp_path, replace(demo, settings=coil)).html.read_text()
    cells = dict(re.findall(r'<th scope="row">(.*?)</th><td>(.*?)</td>', page))
    assert cells["compliance"] == "14 V"
    assert cells["update interval"] == "45.5 ms"
    assert cells["ramps"] == "no" and cells["A2"] == "2250 mm²"
    assert cells["k_F"] == "1.52975 V/N"
    assert cells["output"] == "–" and cells["set_<wbr>by_<wbr>hand_<wbr>s"] == "by hand"


@pytest.mark.parametrize(
    ("cell", "kept"),
    [
        ("296.39 ± 0.50 ms", "296.39 ±_0.50_ms"),
        ("5.73 Hz", "5.73_Hz"),
        ("8.69 s (8.66 to 8.72 s)", "8.69_s (8.66 to 8.72_s)"),
        ("33 %", "33_%"),
    ],
)
def test_a_number_stays_on_one_line_with_its_sign_and_unit(cell, kept):
    table = Table(headings=("Value",), rows=((cell,),))
    blank = dict.fromkeys(("title", "subtitle", "mark", "made"), "")
    names = {**blank, "measured": True, "key": {}, "said": (), "picture": None}
    text = rendered("chart.html", **names, tables=[table])
    assert f"<td>{kept}</td>".replace("_", "\u00a0") in text


def test_the_table_has_one_row_per_trial(demo):
    shown = trials_table(find(demo).run)
    assert [row[0] for row in shown.rows] == ["80 mN", "120 mN", "160 mN", "200 mN"]
    assert shown.rows[0][1:] == ("0", "–", "–", "–", "–", "–", "–")
    spikes = [int(row[1]) for row in shown.rows]
    assert spikes == sorted(spikes)
    assert "10 are needed" in shown.rows[1][-1]
    assert "exceeds the hold of 2 s" in shown.rows[3][-1]


def test_levels_within_the_band_of_the_force_are_told_apart(demo):
    """A search's "96 ± 14 mN" fired, and the next "96 ± 14 mN" did not."""
    known = ForceUncertainty(absolute=0.0, relative=0.14)
    levels = 95.625e-3, 96.25e-3, 97.5e-3
    trials = tuple(replace(demo.trials[0], level=level, label="") for level in levels)
    shown = trials_table(replace(demo, trials=trials, force_uncertainty=known))
    at = shown.headings.index("Force")
    forces = [row[at] for row in shown.rows]
    assert forces == ["95.6 ± 13.4 mN", "96.2 ± 13.5 mN", "97.5 ± 13.7 mN"]
    near = trials_table(replace(demo, trials=trials[::2], force_uncertainty=known))
    assert [row[at] for row in near.rows] == ["96 ± 13 mN", "98 ± 14 mN"]


def test_the_table_says_once_why_trials_have_no_time_constant(demo):
    few = demo.trials[1]
    last = [row[-1] for row in trials_table(replace(demo, trials=(few,) * 3)).rows]
    assert "10 are needed" in last[0]
    assert last[1:] == ["as above", "as above"]
    other = trials_table(replace(demo, trials=(few, demo.trials[3], few))).rows
    assert "as above" not in [row[-1] for row in other]


def test_the_table_stands_in_columns(demo):
    lines = trials_table(find(demo).run).text.splitlines()
    assert sum(not line.startswith(" ") for line in lines) == 6
    assert max(map(len, lines)) <= 100
    column = lines[0].index("Time constant")
    assert all(line[column - 2 : column].strip() == "" for line in lines)


def test_a_long_hold_gives_a_time_constant(run_maker):
    findings = find(run_maker((0.2,), ramp=0.01, hold=10.0, rest=0.5))
    fit = findings.run.results[0].adaptation
    assert fit is not None
    assert 1 < fit.time_constant.value < 5
    told = trials_table(findings.run).rows[0][-1]
    assert told == fit.time_constant.text("s").replace(", 95 %", "")


def test_no_adaptation_is_told_of_a_force_that_is_not_held(run_maker):
    """A scanned grating had a time constant of 0.25 s (0.13 to 3.5 s)."""
    run = run_maker((0.2,), ramp=0.01, hold=10.0, rest=0.5)
    (held,) = run.results
    assert held.adaptation is not None
    scanned = replace(held, level=None)
    assert (scanned.adaptation, scanned.why_not) == (None, "no one force is held")
    assert run.circuit_adaptation(scanned) == (None, "no one force is held")


def test_a_law_that_goes_on_from_the_last_spike_does_not_foretell_it(run_maker):
    """The sensor's own last spike stood as the law's, equal to four digits."""
    run = run_maker((0.15,), ramp=0.01, hold=10.0, rest=0.5)
    told = Hold().conclude(replace(run, circuit=Circuit())).sentences[0]
    last = f"{run.results[0].response.silent:.4g} s"
    assert f"After the sensor's last spike at {last} it charges C2 to no" in told


def test_the_caption_says_whether_the_current_was_played(demo):
    assert "its steps are the source's set-points" in overview(demo).caption
    played = overview(replace(demo, listed=True)).caption
    assert "its steps are the points of the waveform played" in played


def test_a_long_force_is_drawn_by_as_many_corners_as_can_be_seen(demo):
    """The page of an hour of `repeat` had 115 MB, nearly all of it this line."""
    time = np.linspace(0, demo.duration, 60_000)
    swing = Waveform(time, 0.1 + 0.05 * np.sin(2 * np.pi * 50 * time))
    drawn = overview(replace(demo, force=swing)).panels[0].series[0]
    assert np.size(drawn.x) == np.size(drawn.y) <= 4 * 1601
    assert np.all(np.diff(drawn.x) >= 0)
    assert (np.min(drawn.y), np.max(drawn.y)) == (swing.value.min(), swing.value.max())
    assert (drawn.x[0], drawn.x[-1]) == (0.0, demo.duration)
    whole = overview(demo).panels[0].series[0]
    assert np.array_equal(whole.x[:-1], demo.force.time), "a short one is drawn whole"


def test_i_ds_is_derived_where_v_c1_is_known(demo):
    findings = find(demo)
    derived = findings.run.trace("I_DS")
    assert derived is not None
    assert derived.source == "derived"
    assert derived.mean[:100].min() == pytest.approx(25e-9, abs=2e-9)
    assert "Hz" in findings.notes[0]


def test_i_ds_is_derived_on_both_sides_of_a_gap_beside_which_a_mean_is_shorter(demo):
    """While a source loads a list nothing streams: such a run had no I_DS at all."""
    whole = find(demo).run.trace("I_DS")
    V_C1 = demo.trace("V_C1")
    step = V_C1.time[1] - V_C1.time[0]
    time = V_C1.time[400:].copy()
    time[200:] += 3.0
    time[200] += 0.4 * step  # the middle of what is left of its cell
    torn = replace(V_C1, time=time, mean=V_C1.mean[400:])
    findings = find(replace(demo, traces=(torn,)))
    assert not any("I_DS" in said for said in findings.missing)
    derived = findings.run.trace("I_DS")
    assert np.array_equal(derived.time, np.delete(time, 200))
    inner = slice(250, 3000)
    assert derived.mean[inner] == pytest.approx(whole.mean[401:][inner], abs=1e-12)


def test_pauses_are_no_results(demo):
    pause = MeasuredTrial(
        label="recovery", level=None, start=18.0, duration=50.0,
        spike_times=np.array([]), pause=True,
    )  # fmt: skip
    findings = find(replace(demo, trials=(*demo.trials, pause), duration=68.0))
    assert len(findings.run.results) == 4


def test_gaps_in_a_trace_split_it():
    time = np.array([0.0, 1.0, 2.0, 9.0, 10.0])
    assert stretches(time) == [slice(0, 3), slice(3, 5)]
    assert stretches(np.array([])) == []


@pytest.mark.parametrize("completed", [0, 1])
def test_a_fit_of_a_trial_cut_short_is_told_as_such(run_maker, tmp_path, completed):
    run = run_maker((0.2, 0.2), ramp=0.01, hold=10.0, rest=0.5)
    cut = replace(run.trials[completed], complete=False)
    trials = (*run.trials[:completed], cut)
    report = write(tmp_path, replace(run, trials=trials, status="aborted"))
    page = report.html.read_text(encoding="utf-8")
    assert "Adaptation: α exp(βt) + γ" in page
    assert "there is no result" not in page
    told = "Cut short: 200 mN. The protocol concludes and draws nothing from it"
    assert told in page
    missing = json.loads((tmp_path / "results.json").read_text())["missing"]
    assert sum(told in text for text in missing) == 1


def test_a_run_with_nothing_measured_still_reports(demo, tmp_path):
    empty = replace(
        demo, traces=(), trials=(), loss=None, accuracy="", warnings=(), settings={},
        force=Waveform.constant(0.0), status="aborted",
    )  # fmt: skip
    report = write(tmp_path, empty)
    assert "No trial was completed" in report.html.read_text(encoding="utf-8")
    drawn = overview(report.findings.run)
    assert [panel.label for panel in drawn.panels] == ["Force", "Spikes"]
    assert "Grey bands" not in drawn.caption, "no hold is shaded"


@pytest.mark.parametrize(
    ("scene", "overrides", "onset"),
    [
        ("demo", [], 0.0),
        ("hold_10s", ['protocol.before="0.3 s"'], 0.3),
        ("waveform", [], 0.5),
        ("monitor", [], None),
        ("touch", [], 0.0),
    ],
)
def test_latency_counts_from_where_the_force_begins(scene, overrides, onset):
    trial = next(load(scene, overrides).protocol.trials())
    assert trial.onset == (None if onset is None else pytest.approx(onset))


def test_the_sensor_is_told_as_it_is_at_its_temperature():
    """V_T stood as Table 1's 25 mV in reports of runs at 299 K."""
    assert sensor_texts(load("demo"))["V_T"] == "25 mV"
    warm = sensor_texts(load("demo", ["sensor.temperature=299 K"]))
    assert warm["V_T"] == "25.77 mV (25 mV at 290.1 K)"
    assert warm["I_S"].endswith("(1.216 pA at 290.1 K)")
    assert warm["V_GS"] == "1.4 V"


def test_what_left_its_range_is_shaded_in_its_panels(demo):
    V_C1 = replace(demo.trace("V_C1"), overrange=np.array([[1.0, 1.5], [3.0, 3.25]]))
    others = (t for t in demo.traces if t.signal != "V_C1")
    run = find(replace(demo, traces=(V_C1, *others))).run
    shaded = {
        panel.label: [(g.at, g.to) for g in panel.guides if g.colour == "V_C1"]
        for panel in overview(run).panels
    }
    assert shaded["Voltage"] == shaded["I_DS"] == [(1.0, 1.5), (3.0, 3.25)]
    assert shaded["Force"] == shaded["Rate"] == []


def panel_of(run, label):
    return next(p for p in overview(run).panels if p.label == label)


def test_a_rate_stands_in_the_middle_of_its_interval_and_none_over_a_silence(demo):
    times = np.array([0.5, 0.6, 0.8, 0.9, 3.0, 3.1])
    trial = replace(demo.trials[0], spike_times=times, hold=None)
    run = replace(demo, trials=(trial, *demo.trials[1:2]))
    (rates, *_) = panel_of(run, "Rate").series
    first = rates.x[:4] - trial.start
    np.testing.assert_allclose(first, [0.55, 0.7, 0.85, 3.05])
    np.testing.assert_allclose(rates.y[:4], [10, 5, 10, 10])


def test_many_spikes_are_drawn_as_their_density(demo):
    few = next(p for p in overview(demo).panels if p.label == "Spikes")
    assert few.series[0].mark == "ticks" and few.blank
    times = np.linspace(0.5, 4.0, 351)
    trial = replace(demo.trials[0], spike_times=times)
    (density,) = panel_of(replace(demo, trials=(trial,)), "Spikes/s").series
    inside = (density.x > 0.7) & (density.x < 3.8)
    assert density.y[inside] == pytest.approx(100, rel=0.1)


def test_no_density_of_spikes_is_drawn_where_nobody_looked():
    """A zero line crossed the half minute in which a list was loaded."""
    spikes = np.concatenate([np.linspace(1, 2, 100), np.linspace(41, 42, 100)])
    panel, told = spike_train(spikes, 0.0, 50.0, [(0, 2), (2, 4), (40, 44)])
    (density,) = panel.series
    known = np.isfinite(density.y)
    assert not np.any((density.x[known] > 4) & (density.x[known] < 40))
    area = np.nansum(density.y[:-1] * np.diff(density.x))
    assert area == pytest.approx(200), "each spike once"
    assert told == "200 spikes: how many a second, in 40 bins"


def test_a_hold_is_shaded_from_when_its_force_was_there(demo):
    first, *others = demo.trials
    (start, end), (asked, over) = first.held, first.hold
    late = replace(first, hold=(asked + 0.06, over + 0.06))
    run = replace(demo, trials=(late, *others))
    bands = [g for g in overview(run).panels[0].guides if g.colour == "band"]
    assert bands[0].at == pytest.approx(start + 0.06, abs=0.01)
    assert bands[0].to == pytest.approx(end + 0.06, abs=0.01)


def test_a_single_trial_counts_time_from_its_start(demo):
    trial = replace(demo.trials[0], start=0.3)
    plot = overview(replace(demo, trials=(trial,)))
    assert plot.x_limits == (-0.3, demo.duration - 0.3)
    assert plot.x_label == "Time from the start of the trial"
    assert overview(demo).x_label == "Time"


def test_what_a_protocol_calls_its_trials_stands_in_table_and_figure(demo):
    trials = [
        replace(t, label=f"gap {i} s", level=0.15) for i, t in enumerate(demo.trials)
    ]
    run = replace(demo, trials=tuple(trials))
    told = trials_table(run)
    assert told.headings[:2] == ("Trial", "Force")
    assert [row[:2] for row in told.rows][1] == ("gap 1 s", "150 mN")
    force = overview(run).panels[0]
    texts = [text for s in force.series for text in s.texts]
    assert texts == [t.label for t in trials]
    assert trials_table(demo).headings[0] == "Force", "there the force is the name"


def test_writing_tells_how_far_it_is(demo, tmp_path):
    told = []
    write(tmp_path, demo, progress=told.append)
    assert told == sorted(told) and told[-1] == 1.0 and len(told) > 1


def test_spikes_that_nobody_looked_for_are_not_told_as_none(demo):
    blind = find(replace(demo, searched=False))
    told = page(blind, [])
    assert "not looked for" in told and "Spikes found on line" not in told
    assert "Spikes found on line" in page(find(demo), [])
