"""Settings of the method of the paper and of its authors' code, beside our own."""

from typing import Any, Literal, get_args

Variant = Literal["ours", "paper", "code"]
VARIANTS: tuple[Variant, ...] = get_args(Variant)
WITHOUT_ADDITIONS: dict[str, Any] = {
    "template_variation": 0.0,
    "match_proportions": False,
    "published_draw": True,
    "repair_seams": False,
    "location_weight": 0.0,
    "refine": False,
    "exact_data": False,
}
"""Values that switch off everything that the paper does not have."""
SETTINGS: dict[Variant, dict[str, Any]] = {
    "ours": {},
    "paper": {"similarity": "correlation", **WITHOUT_ADDITIONS},
    "code": {"similarity": "ssd", **WITHOUT_ADDITIONS},
}
"""Parameters that have the same value in every study of a variant."""
LARGEST_CODES = {"paper": 254, "code": 2}
"""Largest facies code that the scores of a variant may have; the smallest is 0."""
