"""What the pages say is run as it stands there."""

from __future__ import annotations

import csv
import io
import os
import subprocess
import sys
from pathlib import Path

import pytest

PACKAGE = Path(__file__).parent.parent
PAGES = [PACKAGE / "README.md", PACKAGE / "../../README.md"]


def examples(text: str) -> str:
    """The indented blocks of Python, one after the other."""
    blocks, block = [], []
    for line in [*text.splitlines(), "end"]:
        if line.startswith("    ") or not line:
            block.append(line[4:])
        else:
            code = "\n".join(block).strip()
            if code.startswith(("import ", "from ", "with nestrad")):
                blocks.append(code)
            block = []
    return "\n".join(blocks)


@pytest.mark.parametrize("page", PAGES, ids=["package", "repository"])
def test_the_examples_of_a_page_run_as_written(page, tmp_path):
    code = examples(page.read_text())
    assert "nestrad.solve(" in code
    ran = subprocess.run([sys.executable, "-c", code], cwd=tmp_path, capture_output=True, text=True, check=False)
    assert ran.returncode == 0, ran.stderr
    assert "incoming" in ran.stdout


def test_the_day_of_a_crop_model(tmp_path):
    ran = subprocess.run(
        [sys.executable, str(PACKAGE / "examples/day.py")],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        check=False,
        env={**os.environ, "PYTHONDONTWRITEBYTECODE": "1"},
    )
    assert ran.returncode == 0, ran.stderr
    rows = list(csv.DictReader(io.StringIO(ran.stdout)))
    assert len(rows) == 10 * 80 * 2
    assert all(float(row["absorbed_W"]) > 0 for row in rows)
    assert ran.stderr.count("UTC") == 10
