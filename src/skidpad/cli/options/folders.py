"""What a command is given as the folder of a run, looked at before anything heavy loads."""

from __future__ import annotations

from pathlib import Path

from skidpad.core.errors import FileError

RESULTS = "results.parquet"  # recording.campaign.results.RESULTS, likewise
TICKS = "ticks.parquet"  # recording.run.log_files.TICKS, which loads the library of tables


def require_run(path: Path, *others: str) -> None:
    """Raises FileError unless a run lies at `path`, or what one of `others` names.

    others: endings of files that the command takes as well, or names in a folder that it takes.
    """
    if (path / TICKS).is_file() or any((path / name).is_file() for name in others):
        return
    if path.suffix and path.suffix in others and path.is_file():
        return
    raise FileError(
        f"{path} is not the folder of a run: it has no {TICKS}; give OUT of `skidpad play`, or "
        "OUT/runs/NAME of a campaign"
    )


def require_campaigns_or_runs(*folders: Path) -> bool:
    """Returns True when all folders are of runs, False when all hold results of a campaign.

    Raises FileError otherwise.
    """
    if all((folder / TICKS).is_file() for folder in folders):
        return True
    for folder in folders:
        if not (folder / RESULTS).is_file():
            raise FileError(
                f"{folder} holds no results of a campaign: it has no {RESULTS}; give the folders that "
                "two campaigns wrote to, or those of two runs"
            )
    return False
