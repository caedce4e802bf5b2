"""The page of an array: what its film is told."""

import base64
import json

import numpy as np
import pytest

from tactile_lab.report.taxel_map import GREY, draw_maps
from tactile_lab.skin.adaptation import adaptation_of
from tactile_lab.skin.events import Events
from tactile_lab.skin.page import FADING, film, maps, write_page
from tactile_lab.skin.press import press
from tactile_lab.skin.skin import load_skin
from tactile_lab.skin.squares import squares_of

BALL = {
    "duration": "1.5 s",
    "array": {"grid": [3, 4], "dead": [2], "stuck": [7], "stuck_rate": "2 kHz"},
    "stimulus": [{"kind": "sphere", "force": "3 N", "start": "0.1 s"}],
}


def pressed(folder, skin):
    """The skin, and its events."""
    skin = load_skin(skin)
    press(skin, folder)
    return skin, Events.read(folder)


def film_of(skin, events):
    """What the script of a page is given, its counts as an array."""
    told = json.loads(film(skin, events)["data"])
    raw = base64.b64decode(told["counts"])
    kind = {1: np.uint8, 2: "<u2"}[told["bytes"]]
    return told, np.frombuffer(raw, kind).reshape(told["frames"], -1)


def test_the_film_counts_every_spike_and_leaves_stuck_taxels_out_of_its_scale(tmp_path):
    skin, events = pressed(tmp_path, BALL)
    told, counts = film_of(skin, events)
    assert np.array_equal(counts.sum(axis=0), events.count)
    assert told["dead"] == [2] and told["stuck"] == [7]
    whole = np.arange(12) != 7
    assert told["most_of_all"] == events.count[whole].max() < events.count[7]
    faded, most = np.zeros(12), 0.0
    for frame in counts:
        faded = FADING * faded + frame
        most = max(most, faded[whole].max())
    assert told["most"] == pytest.approx(most)
    assert counts[:, whole].sum(axis=1).argmax() == told["fullest"]


def test_more_spikes_in_a_frame_than_a_byte_holds_are_counted(tmp_path):
    stuck = {"grid": [1, 2], "dead": [0], "stuck": [1], "stuck_rate": "10 kHz"}
    skin = {**BALL, "duration": "6 s", "array": stuck}
    told, counts = film_of(*pressed(tmp_path, skin))
    assert told["bytes"] == 2
    assert counts.sum() == 60_000 and counts.max() > 255
    assert told["most"] == told["most_of_all"] == 1


def test_who_fired_too_rarely_has_no_fall_in_the_map_but_is_marked(tmp_path):
    array = {"grid": [9, 9], "pitch": "1 mm", "dead": [2], "stuck": [7]}
    skin, events = pressed(tmp_path, {**BALL, "duration": "0.6 s", "array": array})
    found = adaptation_of(skin, events)
    shown = maps(skin, events, found)
    rate, fall = shown.maps
    rare = fall.grey[1]
    assert rare.any() and np.isnan(fall.values[rare]).all()
    assert (rate.values[rare] > 0).all() and np.isnan(rate.values[7])
    assert shown.framed[1][7] and shown.crossed[1][2]
    assert rate.full == np.nanmax(rate.values) and fall.full == 1
    figure = draw_maps(shown, "A ball", "12 taxels")
    # no bench took part
    assert "SIMULATED" in [text.get_text() for text in figure.texts]
    (squares,) = figure.axes[2].collections
    assert {tuple(c) for c in squares.get_facecolors()[rare]} == {GREY}
    assert "No map of adaptation" in maps(skin, events, None).caption


def test_a_skin_where_nothing_fires_has_its_page(tmp_path):
    light = {**BALL["stimulus"][0], "force": "1 mN"}
    array = {"grid": [1, 3], "dead": [2], "stuck": [0]}
    skin = load_skin({**BALL, "stimulus": [light], "array": array})
    done = press(skin, tmp_path)
    events = Events.read(tmp_path)
    page = write_page(skin, events, done, adaptation_of(skin, events), tmp_path)
    text = page.read_text("utf-8")
    assert "no taxel has two whole intervals" in text
    assert "Receptive field" not in text
    assert (tmp_path / "maps.png").stat().st_size > 0


@pytest.mark.parametrize(
    "where",
    [
        {"grid": [120, 100]},
        {"hexagonal": [101, 110]},
        {"positions": [[f"{2 * k} mm", f"{k % 7} mm"] for k in range(-500, 500)]},
    ],
)
def test_squares_of_many_taxels_lose_none_and_hold_about_as_many_each(where):
    array = load_skin({**BALL, "array": where}).array
    squares = squares_of(array, 600)
    n = squares.places.shape[0]
    assert 100 < n <= 660 and not squares.single
    each = squares.total(np.ones(array.size))
    assert each.sum() == array.size and each.max() == squares.fullest
    assert "positions" in where or np.median(each) >= 0.8 * squares.fullest
    apart = np.abs(array.places - squares.places[squares.of_taxel]).max()
    assert apart <= 1.1 * squares.side
    assert squares_of(array, array.size).single


def test_the_page_of_more_taxels_than_can_be_seen_gathers_them_and_says_so(tmp_path):
    array = {"grid": [100, 102], "dead": [9], "stuck": [5098], "stuck_rate": "2 kHz"}
    skin, events = pressed(tmp_path, {**BALL, "array": array})
    told, counts = film_of(skin, events)
    whole = np.arange(events.count.size) != 5098
    assert counts.shape == (200, 50 * 51) and len(told["x"]) == 50 * 51
    assert counts.sum() == events.count[whole].sum() > 0
    assert told["most_of_all"] == counts.sum(axis=0).max()
    assert not told["dead"] and not told["stuck"]
    caption = film(skin, events)["caption"]
    assert "10,200 are drawn as 2,550 squares of up to 4 taxels each" in caption
    assert len(film(skin, events)["data"]) < 1_000_000
    shown = maps(skin, events, adaptation_of(skin, events))
    assert "2,550 squares" in shown.caption
    rate, _ = shown.maps
    mean = events.count[whole].sum() / events.duration / 10_200
    assert np.nanmean(rate.values) == pytest.approx(mean, rel=0.02)
