"""Runs, monitors and manual control: what uses a bench, here or in a process beside."""
