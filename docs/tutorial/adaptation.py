"""From nothing to a fitted adaptation curve.

Run it with ``.venv/bin/python docs/tutorial/adaptation.py``; the text that goes with it
is docs/tutorial/adaptation.md. The tests execute this file as it stands.
"""

import sys

import tactile_lab
from tactile_lab.analysis.adaptation import fit_adaptation
from tactile_lab.analysis.spike_train import respond
from tactile_lab.spikes.rate import rate

out = sys.argv[1] if len(sys.argv) > 1 else "runs"

# 1. A scene says what one run uses. This one ships with the program: 150 mN for 10 s.
#    Anything in it can be changed: SI numbers, or texts with a unit. V_K finds the
#    spikes, nothing else needs to be stored. The simulated bench takes about a second;
#    on a real one, name its bench file: run(..., bench="my_bench.toml").
run = tactile_lab.run(
    "hold_10s",
    {"protocol.level": "180 mN", "record.signals": ["V_C1", "V_K", "spikes"]},
    out=out,
)
print(run)

# 2. Trials and spikes are arrays; times are in s, the trial's own begin at its start.
(trial,) = run.trials
spikes = run.spikes["time"] - trial["start"]
hold = run.holds[0]  # when the force stood: a coil comes to it later than asked
answer = respond(spikes, hold=hold)
print(f"first spike {answer.latency:.3f} s after the onset of the force")
print(f"highest rate {answer.peak_rate:.1f} Hz, final rate {answer.final_rate:.1f} Hz")
print("rate 1, 2 and 4 s into the hold:", rate(spikes, [1.25, 2.25, 4.25]))

# 3. Fit alpha exp(beta t) + gamma to the spikes within the hold. Where the hold is too
#    short or the spikes too few this raises NotIdentifiableError and says so.
fit = fit_adaptation(spikes, hold)
tau = fit.time_constant
print(
    f"time constant {tau.value:.2f} s, 95 % interval {tau.low:.2f} to {tau.high:.2f} s"
)
print(f"from {fit.intervals} intervals, R² = {fit.r_squared:.3f}")

# 4. Figure, page and numbers of the whole run were written with it.
print(f"look at {run.path / 'report.html'}")
