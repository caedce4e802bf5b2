"""The benchmark data set: the same from a seed, its answers balanced, its card."""

import numpy as np
import pytest
from click.testing import CliRunner

from tactile_lab.cli import cli as command_line
from tactile_lab.errors import RunFolderError
from tactile_lab.skin import decoder
from tactile_lab.skin.card import write_card
from tactile_lab.skin.dataset import LABELS, Dataset, make, touch
from tactile_lab.skin.decoder import beyond_chance, distances, information
from tactile_lab.skin.single import simulate_taxel
from tactile_lab.skin.skin import load_skin


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    folder = tmp_path_factory.mktemp("dataset") / "touches"
    done = CliRunner().invoke(
        command_line, ["skin", "--dataset", str(folder), "--touches", "8"]
    )
    assert done.exit_code == 0, done.output
    return folder, Dataset.read(folder), done.output


def test_a_data_set_is_the_same_from_its_seed_on_any_cores(made):
    _, data, _ = made
    again = make(1, 8, cores=1)
    for name in ("time", "taxel", "first", "task", "label", "test"):
        assert np.array_equal(getattr(data, name), getattr(again, name)), name
    assert not np.array_equal(make(2, 1).time, make(1, 1).time)


def test_its_spikes_are_those_of_single_simulations(made):
    _, data, _ = made
    for task in LABELS:
        number = int(data.chosen(task, test=True)[0])
        skin = touch(1, task, 8)
        for taxel in (27, 36):
            alone = simulate_taxel(skin, taxel).spike_times
            assert np.array_equal(data.train(number, taxel), alone)
            counts = data.counts(np.array([number]))[0]
            first = data.latencies(np.array([number]))[0]
            assert counts[taxel] == alone.size
            assert first[taxel] == (alone[0] if alone.size else 0.6)


def test_training_and_test_share_no_touch_and_answers_are_balanced(made):
    _, data, _ = made
    assert data.test.sum() == data.task.size / 2 == 32
    for task, labels in LABELS.items():
        for test in (False, True):
            part = data.chosen(task, test=test)
            assert set(np.bincount(data.label[part])) == {8 // len(labels)}
    heads = {data.time[i : i + 3].tobytes() for i in data.first[:-1]}
    assert len(heads) > 50


def test_the_card_says_how_far_a_plain_decoder_gets(made):
    folder, _, told = made
    card = (folder / "README.md").read_text()
    for task in LABELS:
        assert f"| {task} |" in card and f"\n{task:<12}" in told
    assert "Wilson's 95 % interval" in card and "12.5%" in card
    assert "from the supply" in card


def test_without_a_spike_there_is_no_energy_of_one(made, tmp_path, monkeypatch):
    _, data, _ = made

    def light(seed, task, number):
        ball = {"kind": "sphere", "force": "1 mN"}
        few = {"duration": "0.6 s", "array": {"grid": [1, 1]}, "stimulus": [ball]}
        return load_skin(few)

    monkeypatch.setattr(decoder, "touch", light)
    spent, rest = decoder.energy_per_spike(data)
    assert spent is None and 0.99 < rest < 1, "1 mN is not quite rest"
    card = write_card(tmp_path, data, {}, (spent, rest), "made").read_text()
    assert "Energy: no spikes to share" in card


def test_information_is_what_a_spike_tells_by_its_taxel():
    label = np.array([0, 0, 1, 1])
    telling = np.array([[2, 0], [2, 0], [0, 2], [0, 2]])
    assert information(telling, label) == pytest.approx(1.0)
    assert information(np.ones((4, 2)), label) == 0.0
    assert information(np.zeros((4, 2)), label) == 0.0


def test_distances_are_those_of_one_spike_more_and_one_moved():
    trains = [np.array([0.1]), np.array([0.1, 0.3]), np.array([0.11])]
    victor, rossum = distances(trains)
    assert victor[0, 1] == pytest.approx(1.0)
    assert victor[0, 2] == pytest.approx(0.01 / 0.05)
    assert rossum[0, 0] == pytest.approx(0.0, abs=1e-6) and rossum[0, 1] > 0.9


def test_what_is_no_data_set_is_refused(tmp_path):
    with pytest.raises(RunFolderError, match="holds no data set"):
        Dataset.read(tmp_path)
    both = CliRunner().invoke(command_line, ["skin", "x.toml", "--dataset", "y"])
    neither = CliRunner().invoke(command_line, ["skin"])
    assert both.exit_code == neither.exit_code == 2
    assert "or --dataset FOLDER" in both.output and "or --dataset" in neither.output


@pytest.mark.parametrize("seed", range(8))
def test_spikes_that_tell_nothing_tell_no_negative_amount(seed):
    drawn = np.random.default_rng(seed)
    counts, label = drawn.poisson(5.0, (80, 16)), np.arange(80) % 4
    told, spread = beyond_chance(counts.astype(float), label, 1)
    assert 0 <= told < 5 * spread and not f"{told:.3f}".startswith("-")
    counts[label == 2] *= 4
    assert beyond_chance(counts.astype(float), label, 1)[0] > 0.2
