"""Oscilloscopes that speak USBTMC, each model a row of data."""
