"""The page of an array: what its film is told."""

import base64
import json
import re

import numpy as np
import pytest

from tactile_lab.skin.events import Events
from tactile_lab.skin.page import FADING, write_page
from tactile_lab.skin.press import press
from tactile_lab.skin.skin import load_skin

BALL = {
    "duration": "1.5 s",
    "array": {"grid": [3, 4], "dead": [2], "stuck": [7], "stuck_rate": "2 kHz"},
    "stimulus": [{"kind": "sphere", "force": "3 N", "start": "0.1 s"}],
}


def paged(folder, skin):
    """The page's text, and the events it tells of."""
    skin = load_skin(skin)
    done = press(skin, folder)
    return write_page(skin, Events.read(folder), done, folder).read_text("utf-8")


def film_of(page):
    """What the script of a page is given, its counts as an array."""
    told = re.search(r'id="film">(.*?)</script>', page, re.S)[1]
    film = json.loads(told)
    raw = base64.b64decode(film["counts"])
    kind = {1: np.uint8, 2: "<u2"}[film["bytes"]]
    return film, np.frombuffer(raw, kind).reshape(film["frames"], -1)


def test_the_film_counts_every_spike_and_leaves_stuck_taxels_out_of_its_scale(tmp_path):
    film, counts = film_of(paged(tmp_path, BALL))
    events = Events.read(tmp_path)
    assert np.array_equal(counts.sum(axis=0), events.count)
    assert film["dead"] == [2] and film["stuck"] == [7]
    whole = np.arange(12) != 7
    assert film["most_of_all"] == events.count[whole].max() < events.count[7]
    faded, most = np.zeros(12), 0.0
    for frame in counts:
        faded = FADING * faded + frame
        most = max(most, faded[whole].max())
    assert film["most"] == pytest.approx(most)
    assert counts[:, whole].sum(axis=1).argmax() == film["fullest"]


def test_more_spikes_in_a_frame_than_a_byte_holds_are_counted(tmp_path):
    stuck = {"grid": [1, 2], "dead": [0], "stuck": [1], "stuck_rate": "10 kHz"}
    film, counts = film_of(paged(tmp_path, {**BALL, "duration": "6 s", "array": stuck}))
    assert film["bytes"] == 2
    assert counts.sum() == 60_000 and counts.max() > 255
    assert film["most"] == film["most_of_all"] == 1
