"""The coil's thread, driven without a run."""

from tactile_lab.engine.bench import open_bench
from tactile_lab.engine.manual import ManualControl
from tactile_lab.planning.needs import needs
from tactile_lab.scene.load import load
from tactile_lab.waveform import Waveform


def test_an_idle_coil_is_set_as_soon_as_it_is_asked_to():
    scene = load("demo")
    bench = open_bench(scene, needs(scene))
    clock, hand = bench.clock, ManualControl(scene, bench=bench)
    with clock.taking_part("test"):
        hand.renew()
        hand.thread.start()
        assert clock.wait_for(lambda: hand.thread.opened, 2.0)
        hand.thread.energise()
        clock.wait_for(lambda: hand.thread.live)
        clock.sleep_until(clock.now() + 0.037)  # at no beat of the idle thread
        hand.renew()
        hand.thread.take_applied()
        asked = clock.now()
        hand.thread.play(Waveform.constant(0.1), 1e9)
        clock.sleep_until(asked + 0.3)
        applied = hand.thread.take_applied()
        hand.stop("seen enough")
        clock.wait_for(lambda: hand.thread.ended)
    assert applied[0].asked == asked
    assert hand.thread.off is not None and hand.thread.off.verified
