"""Spike detection on streamed codes: settings, detectors and their compiled loop."""
