"""A campaign of trifles that takes a moment per run, so that there is something to kill."""

import sys
import time
from dataclasses import replace
from pathlib import Path

import toy_campaign
from skidpad.campaign.campaign import Campaign

MOMENT = 0.05  # s


def toss(out, task):
    time.sleep(MOMENT)
    folder = out / "runs" / task.name
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "log.txt").write_text(task.name)
    return toy_campaign.toss(out, task)


def campaign(n):
    """n tosses each of two cells."""
    return Campaign(replace(toy_campaign.RECIPE, drive=toss), toy_campaign.campaign(n).tasks)


def main():
    """Drive or resume it as the command line does."""
    from skidpad.cli.campaigns import Drive
    from skidpad.cli.main import guarded

    guarded(
        lambda: Drive(out=Path(sys.argv[1]), workers=2, resume=True)(
            campaign(int(sys.argv[2])), lambda folder: "done"
        )
    )


if __name__ == "__main__":
    main()
