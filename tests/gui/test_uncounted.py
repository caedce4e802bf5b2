"""No rate is told of spikes that are no count, as in the report."""

import h5py
import numpy as np

from tactile_lab.engine.execution import Execution
from tactile_lab.engine.request import Request
from tactile_lab.measurement import BETWEEN_SAMPLES, TOO_FAST
from tactile_lab.scene.load import load
from tactile_lab.store.run import Run


def told(lab, key: str) -> tuple[str, str]:
    """What the card of a lane says: its value, and what stands below."""
    row = lab.window.centre.stack.row(key)
    assert row is not None
    return row.card.text, row.card.more


def test_the_monitor_tells_no_rate_of_spikes_that_are_not_all_seen(
    lab, monkeypatch
) -> None:
    window, session = lab.window, lab.session
    bar = window.centre.monitor_bar
    monkeypatch.setattr(session.bench, "overrides", ('record.sample_rate="200 kS/s"',))
    session.show_monitor(True)
    lab.until(lambda: session.monitor.sensor.V_C1 is not None)
    assert not session.monitor.sensor.counted, "as tactile-lab monitor says"
    lab.until(lambda: "Rate —" in bar.words and "V_C1 4" in bar.words)
    session.show_monitor(False)
    lab.until(lambda: not session.monitor.alive)


def test_a_run_tells_no_rate_of_spikes_that_are_not_all_seen(lab) -> None:
    window, session = lab.window, lab.session
    slow = ('record.sample_rate="200 kS/s"', 'protocol.levels=["200 mN"]')
    session.start(Request(str(lab.folder / "short.toml"), slow, "sim"), "Slow")
    lab.until(lambda: not session.busy)
    assert session.source.spikes.size > 1
    window.centre.stack.show_values()
    assert told(lab, "rate") == ("—", "not all are seen")
    assert told(lab, "spikes")[1] == "not all are seen"
    source = session.source
    assert source.trace("rate", 0.0, source.reach, 100).empty
    assert source.rate(source.reach) is None
    assert window.screen_.results.steps[0].uncounted == BETWEEN_SAMPLES
    folder = session.run.folder
    lab.until(lambda: getattr(window.screen_.run, "path", None) == folder)
    window.centre.view.place_cursors(0.5, 1.5)
    stored = window.screen_.run
    assert stored.trace("rate", 0.0, stored.reach, 100).empty
    assert told(lab, "rate")[0] == "—"
    assert "Hz" not in window.centre.tools.readout.toolTip()
    window.centre.view.clear_cursors()
    assert told(lab, "rate") == ("—", "not all are seen")


def test_a_run_tells_no_rate_of_spikes_that_no_circuit_gives(lab) -> None:
    """Live the lane drew 20 kHz of noise at the threshold; the record refused it."""
    window, session = lab.window, lab.session
    noisy = (
        'protocol.levels=["80 mN", "200 mN"]', 'protocol.hold="200 ms"',
        'record.sample_rate="1 MS/s"', 'simulated.noise.V_K="150 mV"',
        'simulated.deviation.V_GS="4 mV"',
    )  # fmt: skip
    session.start(Request(str(lab.folder / "short.toml"), noisy, "sim"), "Noisy")
    lab.until(lambda: not session.busy)
    live = session.source
    why = [one.uncounted for one in window.screen_.results.steps]
    assert why == [TOO_FAST, TOO_FAST], "told as each step ended"
    window.centre.stack.show_values()
    assert told(lab, "rate") == ("—", "no count: too fast")
    assert told(lab, "spikes")[1] == "no count: too fast"
    assert live.spikes.size > 100 and live.rated.size == 0
    folder = session.run.folder
    lab.until(lambda: getattr(window.screen_.run, "path", None) == folder)
    assert window.screen_.run.uncounted == why, "as the record has it"
    window.review.show_tab(3)
    window.spikes.look()
    said = window.review.spikes.said.text()
    window.review.show_tab(0)
    assert said.startswith(f"No count: {TOO_FAST}") and "intervals" in said


def test_a_run_that_sees_all_spikes_tells_their_rate(lab) -> None:
    folder, window = lab.complete_run(), lab.window
    lab.until(lambda: getattr(window.screen_.run, "path", None) == folder)
    assert not window.screen_.run.trace("rate", 0.0, 5.0, 100).empty
    assert told(lab, "rate")[0] != "—" and told(lab, "rate")[1] == ""


def test_no_rate_is_told_in_a_step_whose_channel_left_its_range(lab, tmp_path) -> None:
    """The report refuses that step; the lane drew 12 Hz in it."""
    asked = {
        "protocol.levels": (0.2, 0.2), "protocol.hold": 1.0, "protocol.rest": 0.5,
    }  # fmt: skip
    folder = Execution(load("demo", asked), tmp_path).run().folder
    with Run.load(folder) as run:
        (cut, told), bit = run.trials["start"], list(run.signals).index("V_K")
        first = run.signal("V_K").between(cut + 0.4).start
    with h5py.File(folder / "data.h5", "a") as file:  # as the scope tells of a block
        rows = file["overrange"]
        rows.resize(len(rows) + 1, axis=0)
        rows[-1] = (first, 1000, 1 << bit)
        file["spikes"].attrs["threshold"] = -1  # and V_K never lay below it
    window = lab.window
    window.screen_.open_run(folder)
    lab.until(lambda: getattr(window.screen_.run, "path", None) == folder)
    source = window.screen_.run
    assert [bool(why) for why in source.uncounted] == [True, False]
    seen = source.spikes
    assert np.count_nonzero((seen > cut) & (seen < told)) > 3
    drawn = source.trace("rate", 0.0, source.reach, 1000)
    assert drawn.time.size > 3 and drawn.time.min() > told
    assert source.rate(cut + 0.8) is None and source.rate(told + 0.8) > 1
    view, readout = window.centre.view, window.centre.tools.readout
    view.show_span(cut, 1.0)
    window.centre.stack.show_values()
    assert "ISI" not in window.centre.stack.row("spikes").card.more
    view.place_cursors(cut + 0.3, cut + 0.9)
    assert "Hz" not in readout.toolTip()
    view.place_cursors(told + 0.3, told + 0.9)
    assert "Hz" in readout.toolTip()
    view.clear_cursors()
