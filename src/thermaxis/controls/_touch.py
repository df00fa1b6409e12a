"""What the touch programs of all controls share: the checks of their way, and their head."""

from thermaxis.controls._control import TouchRequest, comment_text
from thermaxis.controls._program import check_travel, travel_line
from thermaxis.errors import ConfigurationError, require_range

NEAR_MM = 0.05
"""A reading so near to an end of the search is no touch, where the control does not say so. [mm]"""
_LEAST_WAY_MM = 0.5  # of the surface from both ends of the search
_LONGEST_SEARCH_MM = 100.0
_LARGEST_POSITION_MM = 99_999.0
_FASTEST_MM_PER_MIN = 2000.0


def touch_head(
    request: TouchRequest, title: str, result: str, longest_pause_s: float = 99_999.0
) -> list[str]:
    """Return the head of a touch program; refuse a touch that axis or control cannot make.

    Positions are judged as programs write them, with three decimals. `result` says where value,
    counter and reading go.
    """
    t = request
    surface, start, end = (round(mm, 3) for mm in (t.surface_mm, t.start_mm, t.end_mm))
    for option, value, least, most in (
        ("--search", t.search_mm, 2 * _LEAST_WAY_MM, _LONGEST_SEARCH_MM),
        ("--feed", t.feed_mm_per_min, 1.0, _FASTEST_MM_PER_MIN),
        ("--times", t.touches, 1, 9999),
        ("--every", t.pause_s, 0.0, longest_pause_s),
        ("--from", start, -_LARGEST_POSITION_MM, _LARGEST_POSITION_MM),
    ):
        require_range(option, value, least, most)
    ahead, behind = (round(abs(surface - place), 3) for place in (start, end))
    if not (min(ahead, behind) >= _LEAST_WAY_MM and ahead < t.search_mm):
        raise ConfigurationError(
            "surface_outside_search",
            surface_mm=surface,
            start_mm=start,
            end_mm=end,
            least_mm=_LEAST_WAY_MM,
            key="--touch",
        )
    check_travel((start, end), t.travel, "mm")
    lines = (
        f"thermaxis touch program for {title}",
        f"axis {t.axis} searches from {start:.3f} to {end:.3f} mm machine coordinates",
        f"feed {t.feed_mm_per_min:g} mm per min. {t.touches} touches pause {t.pause_s:g} s",
        f"value is surface {surface:.3f} mm minus reading in um",
        f"result {result}",
        travel_line(t.travel, "mm"),
        "Prove with reduced feed before the run. All other axes stand still.",
    )
    return [comment_text(line, 100) for line in lines]
