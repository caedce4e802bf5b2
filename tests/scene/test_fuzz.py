"""Whatever a scene file holds, loading it gives a scene or one clear refusal."""

import tomllib
from pathlib import Path

from hypothesis import example, given, settings
from hypothesis import strategies as st

from tactile_lab.errors import SceneError
from tactile_lab.plugins import scene_path
from tactile_lab.scene.load import TABLES, load, resolve

DEMO = scene_path("demo").read_text(encoding="utf-8")

words = st.sampled_from(
    [
        *TABLES,
        "name",
        "levels",
        "hold",
        "file",
        "signals",
        "sample_rate",
        "C1",
        "start",
        "V_P",
        "noise",
        "V_K",
        "seed",
        "magnet",
        "r",
        "scope",
        "channels",
        "signal",
        "input",
        "limits",
        "coil",
    ]
)
texts = st.text(
    st.characters(exclude_categories=["Cs"], exclude_characters="\r"), max_size=12
)
scalars = st.one_of(
    st.booleans(),
    st.integers(-(2**63), 2**63 - 1),
    st.floats(allow_nan=False, allow_infinity=False),
    texts,
    st.sampled_from(["pulses", "waveform", "2 s", "50 mN", "V_C1", "A", "sim", "6 mm"]),
)
values = st.recursive(
    scalars,
    lambda inner: st.one_of(
        st.lists(inner, max_size=3), st.dictionaries(words, inner, max_size=3)
    ),
    max_leaves=6,
)


@settings(max_examples=150)
@given(st.dictionaries(words, values, max_size=3))
@example({"protocol": {"name": "pulses", "levels": [["50 mN"]]}})
@example({"protocol": {"name": "pulses"}, "bench": {"scope": {"channels": "A"}}})
@example({"protocol": {"name": "pulses"}, "sensor": {"start": {}}})
@example({"protocol": {"name": "pulses"}, "bench": {"coil": 3, "file": 3}})
@example({"protocol": {"name": "pulses"}, "simulated": {"noise": 3}})
def test_any_tables_are_a_scene_or_a_refusal(data):
    try:
        scene = resolve(data, Path("fuzz.toml"))
    except SceneError as refused:
        assert str(refused).strip()
    else:
        again = resolve(tomllib.loads(scene.to_toml()), Path("fuzz.toml"))
        assert again.to_toml() == scene.to_toml()


@settings(max_examples=150)
@given(st.data())
def test_a_damaged_demo_is_a_scene_or_a_refusal(tmp_path_factory, data):
    text = bytearray(DEMO.encode())
    for _ in range(data.draw(st.integers(1, 4))):
        at = data.draw(st.integers(0, len(text) - 1))
        text[at : at + data.draw(st.integers(0, 3))] = data.draw(st.binary(max_size=3))
    path = tmp_path_factory.mktemp("fuzz") / "damaged.toml"
    path.write_bytes(bytes(text))
    try:
        load(path)
    except SceneError as refused:
        assert "damaged.toml" in str(refused)
