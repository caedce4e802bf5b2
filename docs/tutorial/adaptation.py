"""From nothing to a fitted adaptation curve.

Run it with ``.venv/bin/python docs/tutorial/adaptation.py``; the text that goes with it
is docs/tutorial/adaptation.md. The tests execute this file as it stands.
"""

import sys
from pathlib import Path

from tactile_lab.analysis.adaptation import fit_adaptation
from tactile_lab.analysis.spike_train import rate, respond
from tactile_lab.engine.execution import Execution
from tactile_lab.report.from_run import read
from tactile_lab.report.write import write
from tactile_lab.scene.load import load

out = Path(sys.argv[1]) if len(sys.argv) > 1 else Path("runs")

# 1. A scene says what one run uses. This one ships with the program: 150 mN for 10 s.
#    Anything in it can be overridden, with units. V_K finds the spikes, nothing else
#    needs to be stored.
scene = load(
    "hold_10s",
    overrides=['protocol.level="180 mN"', 'record.signals=["V_C1", "V_K", "spikes"]'],
)

# 2. Run it. The simulated bench takes about a second; on a real one, name its bench
#    file: load("hold_10s", bench="my_bench.toml").
done = Execution(scene, out).run()
print(f"{done.state}: {done.spikes} spikes, stored in {done.folder}")

# 3. Read it back as plain numbers.
run = read(done.folder)
trial = run.trials[0]
assert trial.hold is not None
answer = respond(trial.spike_times, hold=trial.hold)
print(f"first spike {answer.latency:.3f} s after the onset of the force")
print(f"highest rate {answer.peak_rate:.1f} Hz, final rate {answer.final_rate:.1f} Hz")
print("rate 1, 2 and 4 s into the hold:", rate(trial.spike_times, [1.25, 2.25, 4.25]))

# 4. Fit alpha exp(beta t) + gamma to the spikes within the hold. Where the hold is too
#    short or the spikes too few this raises NotIdentifiableError and says so.
fit = fit_adaptation(trial.spike_times, trial.hold)
tau = fit.time_constant
print(
    f"time constant {tau.value:.2f} s, 95 % interval {tau.low:.2f} to {tau.high:.2f} s"
)
print(f"from {fit.intervals} intervals, R² = {fit.r_squared:.3f}")

# 5. Figure, page and numbers of the whole run.
report = write(done.folder, run)
print(f"look at {report.html}")
