"""Tests of the questions about files."""
