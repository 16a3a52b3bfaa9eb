"""Writes the type stub of ``tensegrity._core`` from the built module.

    python bindings/make_stubs.py python/tensegrity/_core.pyi

pybind11-stubgen writes native enums as classes without members; they are put right here.
"""

from __future__ import annotations

import re
import subprocess
import sys
import tempfile
from pathlib import Path

MODULE = "tensegrity._core"
ENUM = re.compile(r"class (?P<name>\w+)\(enum\.Enum\):\n(?P<body>(?:    .*\n|\n)+?)(?=\S)")


def generate() -> str:
    with tempfile.TemporaryDirectory() as directory:
        command = [sys.executable, "-m", "pybind11_stubgen", MODULE, "--output-dir", directory]
        command += ["--numpy-array-wrap-with-annotated", "--exit-code"]
        for enum in ("Chirality", "ConstraintSet"):  # that stand as defaults of arguments
            command += ["--enum-class-locations", f"{enum}:{MODULE}"]
        subprocess.run(command, check=True)
        return (Path(directory) / MODULE.replace(".", "/")).with_suffix(".pyi").read_text()


def with_enum_members(stub: str) -> str:
    def members(match: re.Match[str]) -> str:
        body = re.sub(
            r"    @classmethod\n    def __new__\(cls, value\):\n        \.\.\.\n", "", match["body"]
        )
        body = re.sub(
            rf"    (\w+): typing\.ClassVar\[{match['name']}\].*\n", r"    \1 = ...\n", body
        )
        return f"class {match['name']}(enum.Enum):\n{body}"

    return ENUM.sub(members, stub)


if __name__ == "__main__":
    Path(sys.argv[1]).write_text(with_enum_members(generate()))
