"""Simulation of many realizations: executors, storage, and an estimate of memory."""
