"""Tests of small functions of the pages, without a page."""
