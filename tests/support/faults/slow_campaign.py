"""A campaign of trifles that waits at a gate, so that there is something to kill."""

import sys
import time
from dataclasses import replace
from pathlib import Path

from skidpad.campaign.campaign import Campaign
from support import toy_campaign

GATE = "gate"  # beside the folder: as many tosses may be made; without it, all


def closed(out):
    """Whether nothing more may be tossed."""
    gate, runs = out.parent / GATE, out / "runs"
    if not gate.exists():
        return False
    return runs.exists() and len(list(runs.iterdir())) >= int(gate.read_text())


def toss(out, task):
    while closed(out):
        time.sleep(0.01)
    folder = out / "runs" / task.name
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "log.txt").write_text(task.name)
    return toy_campaign.toss(out, task)


def campaign(n):
    """n tosses each of two cells."""
    return Campaign(replace(toy_campaign.RECIPE, drive=toss), toy_campaign.campaign(n).tasks)


def main():
    """Drive or resume it as the command line does."""
    from skidpad.cli.main import run_guarded
    from skidpad.cli.options.campaigns import CampaignOptions

    run_guarded(
        lambda: CampaignOptions(out=Path(sys.argv[1]), workers=2, resume=True)(
            campaign(int(sys.argv[2])), lambda folder: "done"
        )
    )


if __name__ == "__main__":
    main()
