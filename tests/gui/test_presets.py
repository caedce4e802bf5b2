"""Presets: parameters kept under a name, as scenes that run by themselves."""

import shutil
from pathlib import Path

import pytest

from gui.setup.presets import parameters, presets, save_preset
from tactile_lab.errors import SceneError
from tactile_lab.scene.load import load


def test_preset_is_a_scene_of_its_protocol(tmp_path: Path) -> None:
    scene = load("demo", ["protocol.hold=3 s"])
    file = save_preset(tmp_path, "long hold", scene)
    assert presets(tmp_path, "pulses") == {"long hold": file}
    assert presets(tmp_path, "hold") == {}
    assert load(file).protocol == scene.protocol
    assert parameters(file)["hold"] == 3.0


@pytest.mark.parametrize("name", ["", "../out", "a/b", "." * 3])
def test_names_that_are_no_file_names_are_refused(tmp_path: Path, name: str) -> None:
    with pytest.raises(SceneError, match="cannot be called"):
        save_preset(tmp_path, name, load("demo"))
    assert list(tmp_path.iterdir()) == []


def test_star_keeps_marks_and_takes_up_parameters(lab) -> None:
    setup = lab.window.setup
    before = setup.form.texts()
    setup.form.propose({"hold": "700 ms"})
    setup.star.save("a bit longer")
    assert setup.star.shown() == "a bit longer"
    assert setup.star.accessibleName() == "Preset: a bit longer"
    setup.form.edits.undo()
    assert setup.form.texts() == before and setup.star.shown() == ""
    (file,) = (lab.folder / "presets" / "pulses").iterdir()
    setup.star.use(file)
    assert setup.form.field("hold").text == "700 ms"
    setup.form.edits.undo()
    assert setup.form.texts() == before, "taking up a preset can be undone"
    menu = setup.star.menu_of_presets()
    assert "a bit longer" in [action.text() for action in menu.actions()]
    setup.star.name.setText("../nowhere")
    setup.star.name.returnPressed.emit()
    assert "cannot be called" in setup.problem.text()
    setup.plan_now()


def test_no_preset_is_replaced_or_deleted_without_a_question(lab) -> None:
    """Its name typed again was enough, and one entry of a menu below the names."""
    setup, question = lab.window.setup, lab.window.runs.confirm
    star = setup.star
    setup.form.propose({"hold": "600 ms"})
    star.save("asked of")
    (file,) = (lab.folder / "presets" / "pulses").glob("asked of.toml")
    assert not question.isVisible(), "a new one"
    star.save("asked of")
    assert not question.isVisible(), "the same again"
    setup.form.propose({"hold": "650 ms"})
    star.save("asked of ")
    assert parameters(file)["hold"] == 0.6 and question.isVisible()
    question.leave.click()
    assert parameters(file)["hold"] == 0.6
    star.save("asked of")
    question.do.click()
    assert parameters(file)["hold"] == 0.65 and star.shown() == "asked of"
    for answer, there in (question.leave, True), (question.do, False):
        menu = star.menu_of_presets()
        (out,) = (one.menu() for one in menu.actions() if one.text() == "Delete")
        (entry,) = (one for one in out.actions() if one.text() == "asked of")
        entry.trigger()
        assert file.exists() and question.isVisible()
        answer.click()
        assert file.exists() is there
    setup.form.edits.undo()
    setup.form.edits.undo()


def test_what_a_preset_cannot_do_leaves_the_form_as_it_is(lab) -> None:
    """Its plan was taken away, and Run did nothing, without a word."""
    setup, plan = lab.window.setup, lab.session.plan
    expectation = plan.expectation
    assert expectation is not None and setup.run.isEnabled()
    setup.star.save("../nowhere")
    assert "cannot be called" in setup.problem.text()
    assert not plan.problem and plan.expectation is expectation
    setup.run.click()
    assert lab.session.busy
    lab.session.stop("test is over")
    lab.until(lambda: not lab.session.busy)


def test_unusable_preset_is_told_and_not_taken_up(lab) -> None:
    setup = lab.window.setup
    before = setup.form.texts()
    file = lab.folder / "presets" / "pulses" / "broken.toml"
    file.parent.mkdir(parents=True, exist_ok=True)
    file.write_text('[protocol]\nname = "pulses"\nhold = "3 V"\n')
    setup.star.use(file)
    assert setup.form.texts() == before and "hold" in setup.problem.text()
    file.unlink()
    setup.plan_now()
    setup.star.use(file)  # its menu was open as somebody deleted it
    assert f"The preset {file} cannot be read" in setup.problem.text()
    file.mkdir()
    (file / "inside").touch()
    setup.star._delete(file)
    assert f"The preset {file} was not deleted" in setup.problem.text()
    shutil.rmtree(file)
    setup.plan_now()
