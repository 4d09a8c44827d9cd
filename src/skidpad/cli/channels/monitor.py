"""`skidpad monitor`, `skidpad safety-case`: what channels say, judged."""

from __future__ import annotations

from enum import Enum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from msgspec import Meta, Struct

from skidpad.cli.options.spread import spread_fields
from skidpad.evidence.channels.choices import Form, Identify, Profile

if TYPE_CHECKING:
    import polars as pl

    from skidpad.core.vocabulary import HazardType
    from skidpad.evidence.channels.indicators.catalogue import AnyIndicator
    from skidpad.evidence.channels.monitor import MonitorSettings
    from skidpad.evidence.channels.summary import Watched
    from skidpad.recording.channels.mcap_files import ChannelSource


class Wire(str, Enum):
    """Values that the option --listen takes."""

    ros2 = "ros2"


class Judged(Struct, frozen=True):
    """By what rules and formulas the channels are judged."""

    rules: Annotated[
        Profile,
        Meta(
            description="Hazard rules: safe distances of tracked objects, the published rules corrected, "
            "or as printed."
        ),
    ] = Profile.TRACKED
    forms: Annotated[
        Form | None,
        Meta(
            description="Formulas of the indicators; default: corrected, with as_printed rules completed."
        ),
    ] = None
    rules_file: Annotated[Path | None, Meta(description="Own hazard rules (YAML).")] = None
    thresholds: Annotated[Path | None, Meta(description="Own thresholds (YAML).")] = None
    identifier: Annotated[
        Identify,
        Meta(
            description="What finds the three scored hazards: the rules, the trained model, both."
        ),
    ] = Identify.RULES
    model: Annotated[
        Path | None,
        Meta(description="Trained model (.npz) of `skidpad channels train`; default: ours."),
    ] = None
    grip: Annotated[
        float | None,
        Meta(
            description="Friction of the road (0.05 to 1.5) that the rules tracked are told; 0.9: dry."
        ),
    ] = None

    def to_settings(self) -> MonitorSettings:
        """Returns the monitor's settings; reads the files that are named, with their errors."""
        from skidpad.evidence.channels.hazards import default_form, load_rules
        from skidpad.evidence.channels.identifier.model import load_model
        from skidpad.evidence.channels.indicators.catalogue import load_thresholds
        from skidpad.evidence.channels.indicators.settings import IndicatorSettings
        from skidpad.evidence.channels.monitor import MonitorSettings

        profile, is_by_rules = self.rules, self.identifier is Identify.RULES
        return MonitorSettings(
            indicators=IndicatorSettings(form=self.forms or default_form(profile)),
            profile=profile,
            rules=load_rules(profile, self.rules_file),
            thresholds=load_thresholds(self.thresholds),
            identify=self.identifier,
            detectors={} if is_by_rules else load_model(self.model).identifier(),
            grip=self.grip,
        )


class Listening(Struct, frozen=True):
    """Where channels that drive now are heard."""

    mapping: Annotated[
        Path | None, Meta(description="YAML that says which topics of a ROS 2 bag are what.")
    ] = None
    listen: Annotated[
        Wire | None,
        Meta(description="ros2: watch topics over DDS as they come, named by --mapping."),
    ] = None
    domain: Annotated[
        int, Meta(ge=0, le=232, description="DDS domain of --listen (ROS_DOMAIN_ID).")
    ] = 0
    wait: Annotated[
        float,
        Meta(ge=0.0, description="Seconds that --listen waits for writers, and in silence."),
    ] = 60.0

    def open_source(self, file: Path | None) -> ChannelSource:
        """Returns the recording `file`, or the topics to listen to where it is None.

        Raises ConfigError unless exactly one is asked for, FileError for a missing file.
        """
        from skidpad.core.errors import ConfigError, FileError

        if (file is None) is (self.listen is None):
            raise ConfigError("monitor takes a FILE or --listen ros2, and one of them")
        if file is not None:
            if not file.exists():
                raise FileError(f"{file}: no such file")
            from skidpad.recording.sources import open_channels

            return open_channels(file, self.mapping, truth=False)
        if self.mapping is None:
            raise ConfigError("--listen needs --mapping FILE, which says which topics are what")
        from skidpad.live.ros2.listener import RosTopics
        from skidpad.recording.formats.ros_bag import load_mapping

        mapping = load_mapping(self.mapping)
        return RosTopics(mapping, self.domain, patience=self.wait, silence=self.wait)


@spread_fields()
def monitor(
    out: Annotated[Path, typer.Option(help="Folder for indicators, hazards and the summary.")],
    judged: Judged,
    listening: Listening,
    file: Annotated[
        Path | None,
        typer.Argument(help="A channel recording (.mcap), or a ROS 2 bag with --mapping."),
    ] = None,
    timing: Annotated[
        bool, typer.Option("--timing", help="Measure each module and print the table.")
    ] = False,
    fail_if: Annotated[
        list[str] | None,
        typer.Option(
            help="Exit with 1 when this hazard or indicator violation occurs; may be repeated."
        ),
    ] = None,
    junit: Annotated[
        Path | None, typer.Option(help="Also write the verdicts of --fail-if as JUnit XML.")
    ] = None,
) -> None:
    """Watch what driving channels say: indicators, violations, hazardous scenes."""
    import sys
    import time

    source = listening.open_source(file)  # what is missing is said before anything is loaded
    from skidpad.core.errors import ConfigError
    from skidpad.evidence.channels.timing import time_by_objects, timing_statistics
    from skidpad.live.watch import Alarms, Timer, watch_whole
    from skidpad.recording.sources import file_hash
    from skidpad.report.channels.page import write_drive_report

    wanted = {name: _rule(name) for name in fail_if or []}
    if junit is not None and not wanted:
        raise ConfigError("--junit writes the verdicts of --fail-if, and none is given")
    settings = judged.to_settings()
    timer = Timer(time.thread_time_ns) if timing else None
    told, digest = (Alarms(sys.stdout), "") if file is None else (None, file_hash(file))
    found = watch_whole(source, out, settings, timer, digest, told)
    write_drive_report(out)
    if timer is not None:
        times = timer.table()
        _print_table(timing_statistics(times), "times per cycle, ms, and shares of cycles, %")
        _print_table(time_by_objects(times), "mean times by the number of objects, ms")
    _print(found, out)
    if wanted:
        _gate({name: _events(found, rule) for name, rule in wanted.items()}, junit)


def _rule(name: str) -> HazardType | AnyIndicator:
    """Returns the hazard or indicator that --fail-if names, by name or label; ConfigError otherwise."""
    from skidpad.core.errors import ConfigError
    from skidpad.core.vocabulary import HazardType
    from skidpad.evidence.channels.indicators.catalogue import Indicator, load_thresholds

    by_label = {entry.label: i for i, entry in load_thresholds().items() if entry.threshold}
    known: dict[str, HazardType | AnyIndicator] = {h.value: h for h in HazardType}
    known |= {i.value: i for i in by_label.values()} | dict(by_label)
    if name not in known:
        raise ConfigError(
            f"--fail-if {name!r} is neither a hazard nor an indicator with a threshold; choose of: "
            + ", ".join(n for n in known if n not in {i.value for i in Indicator})
        )
    return known[name]


def _events(found: Watched, rule: HazardType | AnyIndicator) -> int:
    """Returns how often the hazard, or a violation of the indicator, was found."""
    from skidpad.core.vocabulary import HazardType

    if isinstance(rule, HazardType):
        return found.hazards.get(rule, 0)
    return sum(n for (indicator, _), n in found.violations.items() if indicator == rule)


def _print(found: Watched, out: Path) -> None:
    """Prints what a monitor found, what it lost, and where to look next."""
    from skidpad.core.text.wording import count_text

    summary = found.summary
    typer.echo(
        f"{', '.join(found.channels)}: {found.cycles} cycles, {found.hours * 60:.1f} min; "
        f"rules {summary['rules']}, forms {summary['forms']}"
    )
    for hazard, n in found.hazards.items():
        typer.echo(f"  hazard {hazard.value}: {n}")
    if not found.hazards:
        typer.echo("  no hazard found")
    for (indicator, subject), n in sorted(found.violations.items()):
        typer.echo(f"  violation {indicator.value} ({subject}): {n}")
    lost = {k: v for k, v in summary["losses"].items() if v}
    unusable = {k: v for k, v in summary["unusable"].items() if any(v.values())}
    for what, table in (("lost while reading", lost), ("not usable", unusable)):
        if table:
            typer.echo(f"  {what}: " + ", ".join(f"{k} {v}" for k, v in table.items()))
    n = sum(found.hazards.values())
    kinds = ", ".join(hazard.value for hazard in found.hazards)
    typer.echo(f"{count_text(n, 'hazardous scene')} ({kinds})" if n else "no hazardous scene")
    listing = f"; skidpad hazards export {out} writes each as .xosc" if n else ""
    typer.echo(f"Next: {out / 'report.html'} shows the drive{listing}")


SHORT = {  # headings of the table of times, so that it fits a terminal
    "mean_ms": "mean", "max_ms": "most", "min_ms": "least", "std_ms": "std", "p999_ms": "99.9 %",
    "breaches_pct": "beyond", "within_90_pct": "90-100", "under_50_pct": "< 50 %",
}  # fmt: skip


def _print_table(table: pl.DataFrame, title: str) -> None:
    """Prints a table of numbers with three digits, its columns as wide as they must be."""
    heads = [SHORT.get(name, name) for name in table.columns]
    rows = [[f"{v:.3f}" if isinstance(v, float) else str(v) for v in row] for row in table.rows()]
    widths = [max(map(len, column)) for column in zip(heads, *rows, strict=True)]
    typer.echo(title)
    for row in (heads, *rows):
        cells = zip(row, widths, strict=True)
        first = next(cells)
        line = first[0].ljust(first[1]) + "".join(f"  {cell:>{width}}" for cell, width in cells)
        typer.echo(line.rstrip())


def _gate(counts: dict[str, int], junit: Path | None) -> None:
    """Prints what must not occur and did, and exits with 1 then; `junit`: file to write, if any.

    counts: how often each occurred, by name.
    """
    from skidpad.cli.output.junit import write_junit

    wrong = {
        name: [f"{name} occurred {n} time{'' if n == 1 else 's'}"] if n else []
        for name, n in counts.items()
    }
    if junit is not None:
        write_junit(junit, "skidpad monitor", wrong)
    failed = [sentence for by in wrong.values() for sentence in by]
    if failed:
        typer.echo("failed: " + "; ".join(failed), err=True)
        raise typer.Exit(1)


def safety_case(
    folder: Annotated[Path, typer.Argument(help="Output folder of `skidpad monitor`.")],
) -> None:
    """Print the safety case with what the drive says for and against each claim."""
    from skidpad.evidence.channels.case import evidence_lines
    from skidpad.recording.channels.indicators import read_indicators

    for line in evidence_lines(read_indicators(folder)):
        typer.echo(line)
