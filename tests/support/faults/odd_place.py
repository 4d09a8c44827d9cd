"""Drives a campaign of one run wherever and however this process was started."""

import sys
from pathlib import Path

import yaml

from skidpad.campaign.campaign import Campaign
from skidpad.campaign.recipes.matrix import RECIPE
from skidpad.core.run import run_from_plain
from support.faults.readers import here


def main():
    """The run's description stands on the command line, after the folder."""
    from skidpad.report.matrix.page import write_report

    run = run_from_plain(yaml.safe_load(sys.argv[2]), "here")
    summary = Campaign(RECIPE, [run]).run(Path(sys.argv[1]), here, csv=True)
    write_report(summary.folder)
    print(summary.content_hash)


if __name__ == "__main__":
    main()
