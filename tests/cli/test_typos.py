"""What is misspelt is said in one sentence before anything heavy loads."""

from __future__ import annotations

import subprocess
import sys

from skidpad.cli.options import folders
from skidpad.recording.campaign.results import RESULTS
from skidpad.recording.run.log_files import TICKS

TYPOS = """
adas --weather rain-nigt --out X
adas --configs 7 --out X
adas --set foo=1 --out X
adas --profile foo --out X
adas --grip foo --out X
adas --map figur8 --out X
adas --sensors foo --out X
adas --functions foo --out X
adas --stack nofile.py:A --out X
adas --sedes 3 --out X
friction --preset foo
show X
report X
rerun X
export X
play nofile.xosc --out X
grip --scenarios foo --out X
grip --weather foo --out X
drive --weather foo
drive --map foo
drive --configs 9
replay X
watch X
channels drive --route foo --out X
channels drive --strata foo --out X
monitor nofile.mcap --out X
monitor --out X
profiles diff a b
map info foo
bench foo
view nofile
compare X Y
compare X Y --fail-if foo
compare A B --fail-if foo
channels outcomes X
channels evaluate X
channels train X --out Y
hazards list X
hazards export X
grip --map-of foo --out X
campaign estimate adas --weather foo
shadow X
export-dataset --weather foo --out X
profiles show foo
safety-case X
adsa
"""
HEAVY = ("numba", "scipy", "cv2", "matplotlib")
ASK = """
import sys
from skidpad.cli.main import main
for words in sys.stdin.read().strip().splitlines():
    sys.argv = ["skidpad", *words.split()]
    try:
        main()
    except SystemExit as end:
        status = end.code
    print(words, status, [name for name in %r if name in sys.modules], sep="|")
"""


def test_no_typo_waits_for_kernels_and_tables(tmp_path):
    for name in "AB":
        (tmp_path / name).mkdir()
        (tmp_path / name / folders.RESULTS).touch()
    done = subprocess.run(
        [sys.executable, "-c", ASK % (HEAVY,)], input=TYPOS, capture_output=True, text=True,
        cwd=tmp_path, check=False,
    )  # fmt: skip
    rows = [line.split("|") for line in done.stdout.splitlines() if line.count("|") == 2]
    assert [row[0] for row in rows] == TYPOS.strip().splitlines(), done.stderr
    assert [row for row in rows if row[1:] != ["2", "[]"]] == []
    assert (folders.TICKS, folders.RESULTS) == (TICKS, RESULTS)
