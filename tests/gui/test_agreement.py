"""The chip of the model: what it expects, and how well it follows a run."""

import numpy as np

from gui.session.fit import Agreement, FitInput, fit
from gui.state import Lamp
from tactile_lab.trace import Trace


def model_chip(lab):
    (chip,) = [
        one for one in lab.window.header.chips if "Model" in one.accessibleName()
    ]
    return chip


def test_spikes_are_expected_before_a_run_and_the_residual_is_told_after(lab) -> None:
    window, session = lab.window, lab.session
    window.screen_.leave_run()
    window.render_state()
    assert "spikes expected" in model_chip(lab).value.text()
    lab.complete_run()
    lab.until(
        lambda: session.run.agreement is not None and session.run.agreement.in_step
    )
    window.render_state()
    chip, text = model_chip(lab), session.run.agreement.text
    assert chip.value.text() == f"NRMSE {text}"
    assert f"V_C1 {text}" in window.review.results.bars.accessibleName(), "one number"
    assert "in step" in chip.accessibleName()
    assert chip.lamp is Lamp.GOOD
    window.screen_.close_run()
    assert session.run.agreement is None


def test_a_model_beside_the_run_is_told_by_shape_and_word(lab) -> None:
    lab.session.run.agreement = Agreement(error=0.083, rms=0.09)
    lab.window.render_state()
    chip = model_chip(lab)
    assert chip.lamp is Lamp.WARNING
    assert "beside the run" in chip.accessibleName()
    assert chip.value.text() == "NRMSE 8.3 %"
    lab.session.run.agreement = None


def test_a_run_is_compared_between_two_steps_too(lab) -> None:
    """The run of an hour has one step, which does not end."""
    lab.run()
    lab.until(lambda: lab.session.run.agreement is not None)
    results = lab.window.screen_.results
    assert results.steps == []
    lab.session.run.trial, asked = None, results._asked
    lab.window.screen_.compare_live()
    assert results._asked == asked, "where none has begun, it is beside no plan"


def test_in_step_is_a_residual_within_its_band() -> None:
    time = np.linspace(0, 10, 200)
    model = 4 + 0.5 * np.sin(time)
    for off, in_step in ((0.049, True), (0.051, False)):
        both = (Trace.line(time, model + off), Trace.line(time, model))
        found = fit([], FitInput(np.empty(0), np.empty(0), {"V_C1": both})).agreement
        assert found is not None and found.in_step is in_step
        assert abs(found.rms - off) < 1e-6
        assert abs(found.error - off / 1.0) < 1e-3, "over the range of V_C1, 1 V"
