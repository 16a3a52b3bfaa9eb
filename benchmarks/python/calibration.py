"""One calibration of ranges from a whole recording of SUPERball, with its survey.

python benchmarks/python/calibration.py ../shared/data/superball/building45
"""

from __future__ import annotations

import argparse
from pathlib import Path

from timing import Case, hand_over, measure

from tensegrity.ranging import read_anchors, read_ranges
from tensegrity.ranging.calibration import calibrate_ranges


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("recordings", nargs="+", type=Path)
    arguments = parser.parse_args()
    cases = [
        Case(
            f"calibration/{path.name}",
            "calibrate(ranges, anchors)",
            {
                "calibrate": calibrate_ranges,
                "ranges": read_ranges(path),
                "anchors": read_anchors(path),
            },
        )
        for path in arguments.recordings
    ]
    hand_over(measure(cases, repeats=5))


if __name__ == "__main__":
    main()
