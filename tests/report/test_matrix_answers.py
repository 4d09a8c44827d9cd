"""The three answers of the matrix page, by value: rows in, sentences out."""

import re
from dataclasses import replace

import pytest

from skidpad.evidence.drive.findings import FINDINGS
from skidpad.evidence.verdicts import Verdict, judge
from skidpad.recording.campaign.matrix import MATRIX, Metrics
from skidpad.report.matrix.answers import answers
from skidpad.report.matrix.data import EVENTS, FIRST, config_list, load_matrix
from skidpad.report.matrix.figures import collisions, speed_figure
from skidpad.report.matrix.headline import baseline_text, headline_numbers
from skidpad.report.matrix.next import count, kinds_of
from skidpad.report.matrix.page import write_report
from skidpad.report.matrix.tables import count_table, kinds_table
from support.matrix_drawn import key
from support.matrix_made import campaign, clear_cut, metrics

CLAIMS = [f for f in FINDINGS if not f.study]


def told(matrix, crashes=None):
    return answers(matrix, judge(CLAIMS, [matrix.results] * len(CLAIMS)), crashes or {}).items


@pytest.mark.req("R-7")
def test_the_first_answer_names_the_safest_functions_in_each_weather_and_how_sure_that_is(tmp_path):
    first = told(campaign(tmp_path, clear_cut))[0]
    assert first.sentence == (
        "Of the configurations, fewest crashes: in clear sky configuration 1 (ACC) and configuration 2 "
        "(ACC and lane "
        "centring) with 0.00 per run; in heavy rain configuration 1 (ACC) with 0.00 per run."
    )
    clear, rain = first.lines
    # twelve comparisons of ten seeds, the two signs of each equally extreme: 12 * 2 / 2^10
    assert clear == (
        "Clear sky, configuration 1: it has surely fewer crashes than configurations 3 and 4 "
        "(p at most 0.023); its difference from configuration 2 may be chance; "
        "none of its 10 seeds had a crash, which still allows one in up to 26 % of seeds (95 % confidence)."
    )
    assert rain == (
        "Heavy rain, configuration 1: it has surely fewer crashes than configurations 2 to 4 "
        "(p at most 0.023); "
        "none of its 10 seeds had a crash, which still allows one in up to 26 % of seeds (95 % confidence)."
    )


@pytest.mark.req("R-7")
def test_where_chance_may_explain_every_difference_the_first_sentence_says_so(tmp_path):
    """No configuration is named then: that would read as a rank."""
    first = told(campaign(tmp_path, lambda config, kind: metrics(barriers=2)))[0]
    assert first.sentence == (
        "10 seeds are too few to rank the configurations: every difference between two of them may be "
        "chance. All configurations had 2.00 crashes per run in clear sky and 2.00 crashes per run in "
        "heavy rain."
    )
    assert list(first.lines) == []


@pytest.mark.parametrize("rain", [1, 10])
def test_a_configuration_without_a_crash_is_named_only_in_a_weather_where_that_is_sure(
    tmp_path, rain
):
    """rain: seeds of ten in which all but the first configuration crash in rain; one in clear sky."""
    rows = [
        (key(c, f"{kind}-noon", seed, log_hash=f"{c}{kind}{seed}"),
         metrics(barriers=int(c != "1" and seed <= most)))
        for kind, most in (("clear", 1), ("rain", rain))
        for c in "123"
        for seed in range(1, 11)
    ]  # fmt: skip
    MATRIX.write(tmp_path, rows)
    first = told(load_matrix(tmp_path))[0]
    if rain == 1:
        assert first.sentence.startswith("10 seeds are too few to rank the configurations")
        assert "configuration 1" not in " ".join([first.sentence, *first.lines])
    else:
        assert first.sentence == (
            "Of the configurations, fewest crashes: in heavy rain configuration 1 (ACC) with 0.00 per "
            "run. All configurations lie within these crashes per run: 0.00 to 0.10 in clear sky."
        )
        assert first.lines[0].startswith("Heavy rain, configuration 1: it has surely fewer crashes")
        assert first.lines[1] == (
            "Clear sky: every difference between two configurations may be chance."
        )


def test_too_few_seeds_name_no_configuration_as_the_one_with_fewest_crashes(tmp_path):
    first = told(campaign(tmp_path, clear_cut, seeds=2))[0]
    assert first.sentence == (
        "All configurations lie within these crashes per run: 0.00 to 7.00 in clear sky; "
        "0.00 to 7.00 in heavy rain."
    )
    assert first.lines[0].startswith("2 seeds per cell cannot tell two configurations apart")


@pytest.mark.req("R-7")
@pytest.mark.parametrize(("seeds", "share", "lines"), [(10, 26, 1), (2, 78, 2)])
def test_where_nobody_crashed_one_sentence_says_so_and_what_that_still_allows(
    tmp_path, seeds, share, lines
):
    matrix = campaign(tmp_path, lambda config, kind: metrics(hit=30 * (config == "0")), seeds)
    first, second, _ = told(matrix)
    assert first.sentence == "Configurations 1 to 4 had no crash in clear sky or heavy rain."
    assert first.lines[0] == (
        f"No crash in {seeds} seeds still allows one in up to {share} % of seeds (95 % confidence)."
    )
    assert len(first.lines) == lines, "two seeds cannot tell configurations apart"
    captions = [first.figure.caption, second.figure.caption]
    assert ("an interval takes 8 seeds" in captions[0]) is (seeds < 8)
    assert ("is corrected for judging 4 of them" in captions[1]) is (seeds == 10)


def test_a_claim_that_every_case_shows_is_not_said_to_be_beyond_chance(tmp_path):
    """Two seeds of a minute show no chance: they show two seeds of a minute."""
    campaign(tmp_path, lambda config, kind: metrics(hit=30 * (config == "0")), seeds=2)
    page = write_report(tmp_path).read_text(encoding="utf-8")
    assert "Supported by every case of these runs: claim A-276, “Without assistance" in page
    card = page[page.index(">A-276<") :].split("</details>")[0]
    assert "more runs may bring one that does not" in card
    assert "chance" not in card
    assert "p &lt;" not in card
    assert "p =" not in card


@pytest.mark.req("R-7", "T-5")
def test_the_first_answer_is_about_functions_and_the_reference_driver_stands_beside_them(tmp_path):
    """A model of a human without a crash hides no comparison of the functions."""

    def of(config, kind):
        return metrics() if config == "reference" else metrics(barriers=int(config))

    first = told(campaign(tmp_path, of, configs=("3", "4", "reference")))[0]
    assert first.sentence == (
        "Of the configurations, fewest crashes: in clear sky configuration 3 "
        "(ACC, lane centring, traffic-light assist and resume) "
        "with 3.00 per run; in heavy rain configuration 3 (ACC, lane centring, traffic-light assist and "
        "resume) with 3.00 per run. "
        "The reference driver, a model of a careful human, had 0.00 in clear sky and 0.00 in heavy "
        "rain, which still allows a crash in up to 26 % of seeds."
    )
    assert first.lines[0].startswith("Clear sky, configuration 3: it has surely fewer crashes ")


@pytest.mark.req("R-7")
def test_the_second_answer_says_what_rain_changes_for_each_configuration(tmp_path):
    second = told(campaign(tmp_path, clear_cut))[1]
    assert second.sentence == (
        "Heavy rain against clear sky: more crashes with configurations 2 and 4; "
        "chance may explain every change of crashes with configurations 1 and 3."
    )
    assert second.lines[4] == (
        "4 · + 80 km/h limiter: crashes per run 2.00 → 5.00; "
        "mean speed 35.0 → 35.0 km/h; dropout 5.0 → 5.0 %."
    )
    assert second.lines[0] == (
        "Read each arrow as clear sky → heavy rain. "
        "Dropout is the share of time without a current measurement of the car ahead."
    )
    assert second.lines[5] == (
        "In “Clear Sky: sunrise, noon and night” and “Heavy Rain: sunrise, noon and night” "
        "each seed gave the same drive, so these count once."
    )


def test_the_third_answer_names_the_commonest_kind_of_the_worst_configuration(tmp_path):
    third = told(campaign(tmp_path, clear_cut))[2]
    assert third.sentence == (
        "190 of 250 crashes were of the kind “into a barrier”: 110 in heavy rain, 80 in clear sky. "
        "Configuration 3 had most crashes of all kinds (140 in 20 drives; next configuration 4 with 70 "
        "in 20)."
    )
    assert third.lines[0].startswith(f"Of {len(CLAIMS)} claims of the published study: ")
    decided = judge(CLAIMS, [campaign(tmp_path, clear_cut).results] * len(CLAIMS))
    named = [j for j in decided if j.verdict is Verdict.CONTRADICTED][:3]
    assert named
    assert list(third.lines[1 : 1 + len(named)]) == [
        f"Contradicted: claim {j.finding.id}, “{j.finding.claim.rstrip('.')}”." for j in named
    ]


@pytest.mark.req("R-7", "X-9")
def test_one_seed_gets_one_line_and_no_test_anywhere_on_the_page(tmp_path):
    matrix = campaign(tmp_path, clear_cut, seeds=1)
    first, second, third = told(matrix)
    assert " ".join(first.lines) == (
        "1 seed per cell cannot tell two configurations apart: what differs may be chance. "
        "It takes at least 9 (`--seeds 9`)."
    )
    assert second.sentence.startswith("1 seed per cell cannot tell two weathers apart")
    assert third.lines[-1].startswith(
        f"One seed per cell judges none of the published study's {len(CLAIMS)} claims"
    )
    page = write_report(tmp_path).read_text(encoding="utf-8")
    text = re.sub(r"<(script|style|svg).*?</\1>|<[^>]+>", " ", page, flags=re.DOTALL)
    for never in (
        r"\bp [=<] ",
        r"\binf\b",
        "unbounded",
        r"\b1 (runs|seeds|claims|events|drives)\b",
    ):
        assert not re.search(never, text), never
    assert 'class="verdict' not in page


def test_the_baseline_stands_in_words_and_moves_no_answer_total_or_figure(tmp_path):
    def busy(config, kind):
        return metrics(hit=300) if config == "0" else clear_cut(config, kind)

    calm, wild = (
        campaign(tmp_path / name, of) for name, of in (("calm", clear_cut), ("wild", busy))
    )
    words = baseline_text(calm)[0].text
    assert "nobody at the pedals: it aims for 150 km/h and never brakes" in words
    assert "every 17 s, the first time after 100 s in the median of 20 drives" in words  # 500 / 30
    assert "every 2 s" in baseline_text(wild)[0].text
    for of in (told, headline_numbers, collisions, speed_figure):
        assert of(calm) == of(wild), of.__name__


def test_weathers_that_every_configuration_drove_alike_are_one_column_and_count_once(tmp_path):
    one, six = (
        campaign(tmp_path / str(alike), clear_cut, 6, alike=alike) for alike in (True, False)
    )
    titles = [title for title, _ in count_table(one, EVENTS, "").columns]
    assert titles == [
        "configuration", "Clear Sky: sunrise, noon and night",
        "Heavy Rain: sunrise, noon and night", "all",
    ]  # fmt: skip
    assert len(count_table(six, EVENTS, "").columns) == 8
    assert (len(one.cell("3")), len(six.cell("3"))) == (12, 36)


def test_the_subtitle_says_how_many_weathers_differ_and_what_the_sensors_are(tmp_path):
    matrix = campaign(tmp_path, clear_cut, 6)
    assert matrix.subtitle.startswith("Configurations 0 to 4 in 6 weathers, 6 seeds of each, on ")
    assert matrix.subtitle.endswith(
        "Weathers that gave the same drives count once (Clear Sky: sunrise, noon and night; "
        "Heavy Rain: sunrise, noon and night)."
    )
    assert re.search(r"sensors (on|simulated from) ", matrix.subtitle)


def test_a_cell_that_drives_as_another_has_its_seeds(tmp_path):
    rows = [
        (key("3", weather, seed, log_hash=f"{weather[:4]}{seed}"), metrics(barriers=seed))
        for weather, seeds in (("clear-noon", 3), ("clear-night", 1), ("rain-noon", 3))
        for seed in range(1, seeds + 1)
    ]
    MATRIX.write(tmp_path, rows)
    matrix = load_matrix(tmp_path)
    assert matrix.cell("3", "clear-night")["seed"].to_list() == [1, 2, 3]
    assert matrix.rate("fatal_collisions", "3", "clear-night").events == 6
    assert [g.weathers for g in matrix.weather_groups] == [
        ("clear-noon", "clear-night"), ("rain-noon",)
    ]  # fmt: skip


@pytest.mark.parametrize("graded", [True, False])
def test_the_kinds_of_crashes_add_up_to_all(tmp_path, graded):
    matrix = campaign(tmp_path, clear_cut, 2)
    kinds = kinds_of(graded)
    found = {k.title: n for k in kinds if (n := count(k, matrix.cell("3")))}
    slow = "contact of 5 to 20 km/h" if graded else "struck from behind or touched sideways"
    assert found == {"into a barrier": 24, slow: 4}
    assert sum(count(k, matrix.finished) for k in kinds) == matrix.finished[EVENTS].sum()


@pytest.mark.req("A-247")
def test_a_crash_is_a_serious_contact_or_a_departure_and_no_graze(tmp_path):
    grazed = Metrics(
        fatal_collisions=3,
        serious_contacts=1,
        contacts_light=2,
        road_departures=0,
        first_fatal_s=7.0,
        first_intervention_s=9.0,
    )
    MATRIX.write(tmp_path, [(key("1", "clear-noon", 1), grazed)])
    row = load_matrix(tmp_path).results.row(0, named=True)
    assert (row[EVENTS], row["fatal_collisions"], row[FIRST]) == (1, 3, 9.0)


@pytest.mark.parametrize("graded", [True, False])
def test_rows_that_count_touches_at_the_side_as_struck_from_behind_say_so(tmp_path, graded):
    run = Metrics(fatal_collisions=3, collisions_vehicle=2, rear_ended=2, distance_km=1.0)
    row = replace(run, serious_contacts=1) if graded else run
    MATRIX.write(tmp_path, [(key("1", "clear-noon", 1), row)])
    titles = [title for title, _ in kinds_table(load_matrix(tmp_path)).columns]
    assert ("of these struck from behind" in titles) is graded
    assert ("of these struck from behind or touched sideways" in titles) is not graded
    assert "rolled over" not in titles  # nobody did


def test_results_that_grade_no_contact_say_that_a_crash_is_an_intervention(tmp_path):
    ungraded = Metrics(fatal_collisions=3, first_fatal_s=7.0)
    MATRIX.write(tmp_path, [(key("1", "clear-noon", 1), ungraded)])
    matrix = load_matrix(tmp_path)
    assert matrix.results[EVENTS].to_list() == [3]
    assert matrix.results[FIRST].to_list() == [7.0]
    assert not matrix.has_grades


@pytest.mark.parametrize(
    ("configs", "words"),
    [
        (["2"], "configuration 2"),
        (["1", "2", "3"], "configurations 1 to 3"),
        (["1", "3", "4"], "configurations 1, 3 and 4"),
        (["reference"], "the reference driver"),
        (["1", "2", "3", "reference"], "configurations 1 to 3 and the reference driver"),
        (["acc+lca"], "acc+lca"),
    ],
)
def test_configurations_are_listed_as_one_would_say_them(configs, words):
    assert config_list(configs) == words
