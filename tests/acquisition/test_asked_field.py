"""The field read by a person: asked, doubted, taken down, or given in a file."""

import pytest
from benches import READ_BY_HAND

from tactile_lab.acquisition.asked_field import AskedField, read_off
from tactile_lab.acquisition.events import RunState
from tactile_lab.commands.read_off import field_reader, readings
from tactile_lab.engine.execution import Execution
from tactile_lab.errors import QuantityError, RefusedError, SceneError
from tactile_lab.planning.needs import needs
from tactile_lab.report.findings import find
from tactile_lab.report.from_run import read
from tactile_lab.scene.load import load
from tactile_lab.store.run import Run

SHORT = ("protocol.points=5", "protocol.loops=0", 'record.signals=["field"]')
FALLING = (1.0, 0.5, 0.0, -0.5, -1.0)
SHOWN = [
    *(f"{10.8 * i + 0.5:.2f}" for i in FALLING),
    *(f"{10.8 * i - 0.5:.2f}" for i in reversed(FALLING)),
    *(f"{10.8 * i + 0.5:.2f}" for i in FALLING[:3]),  # again, for drift
]


def scene(folder, overrides=SHORT):
    path = folder / "bench.toml"
    path.write_text(READ_BY_HAND)
    return load("calibrate_field", overrides, str(path))


class Person:
    def __init__(self, *answers):
        self.answers, self.asked = list(answers), []

    def __call__(self, text):
        self.asked.append(text)
        return self.answers.pop(0)


@pytest.mark.parametrize("given", ["by a person", "in a file"])
def test_a_calibration_from_what_is_read_off(tmp_path, given):
    loaded, person = scene(tmp_path), Person(*SHOWN)
    (tmp_path / "shown.txt").write_text("# mT\n\n" + "\n".join(SHOWN))
    file = tmp_path / "shown.txt" if given == "in a file" else None
    reader = field_reader(loaded, person, file)
    done = Execution(loaded, tmp_path / "runs", asked_field=reader).run()
    assert done.state is RunState.COMPLETE, done.reason
    assert done.off.verified
    with Run.load(done.folder) as run:
        assert run.field["field"] == pytest.approx([float(b) * 1e-3 for b in SHOWN])
    told = " ".join(find(read(done.folder)).conclusion.sentences)
    assert "10.8 mT/A, from 0 T at 0 A" in told and "500.0 ± 6.9 µT" in told
    if given == "by a person":
        assert "shows at 1 A, in mT" in person.asked[0]
        assert len(person.asked) == 13


def test_nobody_to_ask_is_refused_before_anything_is_made(tmp_path):
    with pytest.raises(SceneError, match="--field FILE"):
        Execution(scene(tmp_path), tmp_path / "runs", ask=print)
    assert not (tmp_path / "runs").exists()


def test_a_person_who_leaves_ends_the_run_safely(tmp_path):
    def gone(_):
        raise EOFError("the terminal was closed")

    loaded = scene(tmp_path)
    reader = field_reader(loaded, gone, None)
    done = Execution(loaded, tmp_path / "runs", asked_field=reader).run()
    assert done.exit_code == 3
    assert "the terminal was closed" in done.reason


def test_only_a_scene_that_records_the_field_asks(tmp_path):
    path = tmp_path / "bench.toml"
    path.write_text(READ_BY_HAND)
    quiet = load("calibrate_field", ['record.signals=["coil_current"]'], "sim")
    assert not needs(quiet).asked_field
    wished = ['record.signals=["force"]', "protocol.force_at_zero=true"]
    assert not needs(load("demo", wished, str(path))).asked_field


@pytest.mark.parametrize(
    ("text", "why"),
    [
        ("1\n2\n", "2 readings.*asks for 13"),
        ("\n".join([*SHOWN[:12], "x"]), "line 13"),
        ("\n".join([*SHOWN[:12], "10.8 A"]), "line 13"),
        ("\n".join([*SHOWN[:12], "10.8 T"]), "line 13.*more than"),
    ],
)
def test_a_file_that_does_not_fit_is_refused(tmp_path, text, why):
    (tmp_path / "shown.txt").write_text(text)
    with pytest.raises(SceneError, match=why):
        readings(tmp_path / "shown.txt", scene(tmp_path))


def test_a_file_for_a_bench_with_a_meter_is_refused(tmp_path):
    with pytest.raises(SceneError, match="leave --field out"):
        readings(tmp_path / "shown.txt", load("calibrate_field"))
    # the bench has one, and was told to be given one
    by_hand = load("force_check", (), str(scene(tmp_path).bench.path))
    with pytest.raises(SceneError, match=r'Write "field" into record\.signals'):
        readings(tmp_path / "shown.txt", by_hand)


@pytest.mark.parametrize(
    ("typed", "field"),
    [("5.4", 5.4e-3), ("−5.4", -5.4e-3), ("5.4 mT", 5.4e-3), ("120 µT", 1.2e-4)],
)
def test_a_number_is_in_millitesla(typed, field):
    assert read_off(typed) == pytest.approx(field)


@pytest.mark.parametrize("typed", ["", "nan", "inf", "5,4", "4000", "3 A"])
def test_what_is_no_reading(typed):
    with pytest.raises(QuantityError):
        read_off(typed)


def test_what_is_unexpected_is_typed_twice_and_then_expected():
    person = Person("oops", "30", "31", "31", "15")
    asked = AskedField(person, lambda current: 11e-3 * current)
    assert asked.read(1.0) == (pytest.approx(31e-3), None)
    assert "not a quantity" in person.asked[1]
    assert "11 mT expected" in person.asked[2]
    assert asked.read(0.5) == (pytest.approx(15e-3), None)
    assert person.answers == []


def test_a_file_s_unexpected_reading_is_taken_with_a_doubt():
    asked = AskedField(Person("-11"), lambda current: 11e-3 * current, patient=False)
    field, doubt = asked.read(1.0)
    assert field == pytest.approx(-11e-3) and "check sign" in doubt
    with pytest.raises(RefusedError):
        AskedField(Person("?"), abs, patient=False).read(1.0)
