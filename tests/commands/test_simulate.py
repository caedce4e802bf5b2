"""``tactile-lab simulate``: the interface scripts rely on, to the letter."""

import math

import pytest

SANITY = "time_s,force_N\n0,0\n1,0\n1.01,0.15\n11,0.15\n11.01,0\n"
SCENE = '[protocol]\nname = "waveform"\nfile = "force.csv"\nduration = "13 s"\n'
KEYS = {
    "spike_times_s",
    "samples",
    "error_estimate",
    "run_time_s",
    "left_out",
    "warnings",
}


@pytest.fixture
def sanity(scene_file):
    scene_file(SANITY, "force.csv")

    def make(more=""):
        return scene_file(SCENE + more)

    return make


def test_the_sanity_case(tactile_lab, sanity):
    answer = tactile_lab("simulate", sanity(), "--json")
    assert answer.code == 0
    spikes = answer.json["spike_times_s"]
    assert len(spikes) == 37
    assert spikes[0] == pytest.approx(1.0533804034882868, abs=1e-9)
    assert spikes[-1] == pytest.approx(4.933638227816434, abs=1e-9)


def test_all_keys_are_always_there(tactile_lab, sanity):
    for more in (
        "",
        '[record]\nsignals = ["force"]\n',
        '[record]\nsignals = ["field"]\n',
    ):
        data = tactile_lab("simulate", sanity(more), "--json").json
        assert set(data) == KEYS
        assert set(data["error_estimate"]) == {"spike_time_s", "V_C1_V"}
        assert data["samples"] is None
        assert data["run_time_s"] >= 0


def test_what_only_the_simulated_bench_has_is_said_to_be_left_out(tactile_lab, sanity):
    """Specimen 3 had the spikes of no specimen, and nothing was said."""
    spikes = '[record]\nsignals = ["spikes"]\n'
    more = spikes + '[simulated]\nspecimen = 3\nseed = 4\nV_fire_noise = "20 mV"\n'
    told = tactile_lab("simulate", sanity(more), "--json").json["warnings"]
    left = "is the simulated bench's; simulate leaves it out."
    assert told == [f"simulated.V_fire_noise {left}", f"simulated.specimen {left}"]
    seeded = spikes + "[simulated]\nseed = 4\n"
    assert tactile_lab("simulate", sanity(seeded), "--json").json["warnings"] == []


def test_what_is_not_asked_for_is_null(tactile_lab, sanity):
    path = sanity('[record]\nsignals = ["V_C1"]\n')
    data = tactile_lab("simulate", path, "--json", "--samples", 3).json
    assert data["spike_times_s"] is None
    assert data["error_estimate"]["spike_time_s"] is None
    assert data["error_estimate"]["V_C1_V"] > 0
    assert list(data["samples"]) == ["time_s", "V_C1"]
    assert "spikes" in data["left_out"]


def test_samples_are_even_and_include_both_ends(tactile_lab, sanity):
    path = sanity('[record]\nsignals = ["force", "V_C1", "V_C2", "spikes", "rate"]\n')
    data = tactile_lab("simulate", path, "--json", "--samples", 14).json
    assert data["samples"]["time_s"] == pytest.approx(list(range(14)), abs=0)
    assert set(data["samples"]) == {"time_s", "force", "V_C1", "V_C2", "rate"}
    assert all(len(column) == 14 for column in data["samples"].values())
    assert data["samples"]["force"][2:12] == [0.15] * 10
    assert data["samples"]["V_C1"][0] == pytest.approx(4.347038, abs=1e-6)
    assert data["samples"]["rate"][0] == 0.0


def test_samples_are_right_continuous_at_jumps_of_the_force(tactile_lab, scene_file):
    scene_file("time_s,force_N\n0,0\n0,0.1\n1,0.1\n1,0\n2,0\n2,0.05\n", "force.csv")
    path = scene_file(
        SCENE.replace("13 s", "2 s") + '[record]\nsignals = ["force", "V_P"]\n'
    )
    data = tactile_lab("simulate", path, "--json", "--samples", 3).json
    assert data["samples"]["force"] == [0.1, 0.0, 0.05]
    jump = 1.529750693 * 0.1
    assert data["samples"]["V_P"][0] == pytest.approx(jump, rel=1e-9)
    after = jump * math.exp(-1 / 8.69) - jump
    assert data["samples"]["V_P"][1] == pytest.approx(after, rel=1e-9)


def test_bench_signals_are_left_out_with_a_warning(tactile_lab, sanity):
    path = sanity('[record]\nsignals = ["coil_current", "field", "spikes"]\n')
    answer = tactile_lab("simulate", path, "--json", "--samples", 2)
    data = answer.json
    assert {"coil_current", "field"} <= set(data["left_out"])
    assert list(data["samples"]) == ["time_s"]
    assert any("coil_current" in text for text in data["warnings"])
    assert "coil_current" in answer.err


def test_the_force_is_taken_as_given_beyond_any_coil(tactile_lab, scene_file):
    path = scene_file(
        '[protocol]\nname = "pulses"\nlevels = ["500 mN"]\nramp = "0 s"\n'
    )
    assert tactile_lab("simulate", path, "--json").code == 0


def test_the_paper_s_pulses_give_0_4_17_26_spikes(tactile_lab):
    spikes = tactile_lab("simulate", "--json").json["spike_times_s"]
    counts = [sum(4.5 * i <= t < 4.5 * (i + 1) for t in spikes) for i in range(4)]
    assert counts == [0, 4, 17, 26]


def test_preset_fig5b_fires_for_fifty_seconds(tactile_lab, scene_file):
    scene_file("time_s,force_N\n0,0\n1,0\n1.01,0.05\n105,0.05\n", "force.csv")
    path = scene_file(SCENE.replace("13 s", "105 s") + '[sensor]\npreset = "fig5b"\n')
    spikes = tactile_lab("simulate", path, "--json").json["spike_times_s"]
    assert len(spikes) == 234
    assert 49 < spikes[-1] - 1 < 51


def test_a_cold_start_and_a_negative_g31(tactile_lab, sanity):
    cold = '[sensor]\nstart = { V_P = "0 V", V_C1 = "0 V", V_C2 = "0 V" }\n'
    path = sanity(cold + '[record]\nsignals = ["V_C1"]\n')
    data = tactile_lab("simulate", path, "--json", "--samples", 2).json
    assert data["samples"]["V_C1"][0] == pytest.approx(0.0, abs=1e-12)
    flipped = sanity('[sensor]\ng31 = "-0.039 V m/N"\n')
    spikes = tactile_lab("simulate", flipped, "--json").json["spike_times_s"]
    assert spikes[0] > 11, "only the release drives the sensor towards threshold"


def test_a_tighter_tolerance_moves_spikes_by_less_than_the_estimate(
    tactile_lab, sanity
):
    coarse = tactile_lab("simulate", sanity(), "--json", "--tolerance", "1e-4").json
    fine = tactile_lab("simulate", sanity(), "--json", "--tolerance", "1e-11").json
    moved = [
        abs(a - b)
        for a, b in zip(coarse["spike_times_s"], fine["spike_times_s"], strict=True)
    ]
    assert max(moved) <= coarse["error_estimate"]["spike_time_s"] + 1e-9


@pytest.mark.parametrize(
    "options",
    [
        ("--samples", 1),
        ("--samples", "many"),
        ("--samples", 10**9),
        ("--tolerance", "nan"),
        ("--tolerance", "0"),
        ("--tolerance", "-1"),
        ("--tolerance", "1"),
        ("--tolerance", "fine"),
        ("--unknown",),
        ("--set", "protocol"),
        ("--bench", "nope.toml"),
    ],
)
def test_bad_options_are_refused(tactile_lab, sanity, options):
    answer = tactile_lab("simulate", sanity(), "--json", *options)
    assert answer.code == 2
    assert answer.out == ""
    assert answer.err.strip()
    assert "Traceback" not in answer.err


def test_text_for_people(tactile_lab, sanity):
    answer = tactile_lab("simulate", sanity())
    assert answer.code == 0
    assert "spikes      37" in answer.out
    assert "error" in answer.out
