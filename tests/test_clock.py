"""Time as the program sees it: simulated time repeats exactly, real time passes."""

import random
import threading
import time

import pytest

from tactile_lab.clock import Clock, RealClock, SimulatedClock


def run_together(clock: Clock, *works):
    threads = []
    for number, work in enumerate(works):

        def main(work=work, number=number):
            with clock.taking_part(f"thread {number}"):
                work()

        threads.append(threading.Thread(target=main))
    with clock.taking_part("starter"):
        for thread in threads:
            thread.start()
        clock.sleep_until(1e-9)
    for thread in threads:
        thread.join(60)
        assert not thread.is_alive()


def ticking(clock, period, count, log, name, jitter=None):
    def work():
        for _ in range(count):
            clock.sleep_until(clock.now() + period)
            if jitter:
                time.sleep(jitter.random() * 1e-4)
            log.append((name, clock.now()))

    return work


def test_simulated_threads_interleave_by_time_whatever_the_scheduler_does():
    logs = []
    for seed in range(5):
        clock, log = SimulatedClock(), []
        jitter = random.Random(seed)
        run_together(
            clock,
            ticking(clock, 0.3, 20, log, "a", jitter),
            ticking(clock, 0.5, 12, log, "b", jitter),
            ticking(clock, 0.7, 9, log, "c", jitter),
        )
        logs.append(log)
    assert [t for _, t in logs[0]] == sorted(t for _, t in logs[0])
    assert all(log == logs[0] for log in logs)


def test_time_waits_for_a_thread_that_is_slow_to_begin():
    """It jumped past what the thread was started for, on a busy computer alone."""
    clock, begun = SimulatedClock(), []

    def late():
        time.sleep(0.05)
        with clock.taking_part("late"):
            begun.append(clock.now())

    with clock.taking_part("starter"):
        clock.start(threading.Thread(target=late))
        clock.sleep_until(5.0)
    assert begun == [0.0]


@pytest.mark.skipif(
    not hasattr(time, "CLOCK_BOOTTIME"), reason="Linux tells of the computer's sleep"
)
def test_what_the_computer_sleeps_through_has_passed(monkeypatch) -> None:
    """A run went on as if nothing had been, its current held all the while."""
    clock, told = RealClock(), time.clock_gettime
    slept = {time.CLOCK_BOOTTIME: 3600.0}
    monkeypatch.setattr(
        time, "clock_gettime", lambda which: told(which) + slept.get(which, 0.0)
    )
    assert 3600.0 <= clock.now() < 7200.0


def test_simulated_hour_takes_no_hour():
    clock = SimulatedClock()
    begin = time.monotonic()
    with clock.taking_part("sleeper"):
        clock.sleep_until(3600.0)
    assert clock.now() == 3600.0
    assert time.monotonic() - begin < 60


def test_waiting_for_another_thread_takes_its_simulated_time_only():
    clock, done, seen = SimulatedClock(), [], []

    def worker():
        clock.sleep_until(2.5)
        done.append(True)

    def waiter():
        seen.append((clock.wait_for(lambda: bool(done), until=9.0), clock.now()))

    run_together(clock, worker, waiter)
    assert seen == [(True, 2.5)]


def test_waiting_in_vain_ends_at_the_deadline():
    clock, seen = SimulatedClock(), []
    run_together(
        clock, lambda: seen.append((clock.wait_for(lambda: False, 3.0), clock.now()))
    )
    assert seen == [(False, 3.0)]


def test_a_thread_outside_may_wait_for_what_happens_inside():
    clock, done = SimulatedClock(), []

    def worker():
        clock.sleep_until(100.0)
        done.append(True)

    inside = threading.Thread(target=lambda: run_together(clock, worker))
    inside.start()
    assert clock.wait_for(lambda: bool(done))
    inside.join(60)


def test_a_thread_outside_cannot_sleep_in_simulated_time():
    with pytest.raises(RuntimeError, match="takes part"):
        SimulatedClock().sleep_until(1.0)


def test_real_clock_waits_and_is_woken():
    clock = RealClock()
    begin = clock.now()
    clock.sleep_until(begin + 0.02)
    assert clock.now() >= begin + 0.02
    flag = []

    def wake():
        flag.append(True)
        clock.notify()

    timer = threading.Timer(0.05, wake)
    timer.start()
    assert clock.wait_for(lambda: bool(flag), clock.now() + 10)
    assert clock.now() < begin + 5
    timer.join()
    assert not clock.wait_for(lambda: False, clock.now() + 0.01)
