import json
import re

import pytest

from skidpad.report.elements.page import (
    Card,
    Cards,
    Cell,
    Code,
    Definitions,
    Figure,
    Page,
    Section,
    Table,
    Text,
    render,
    write_page,
)
from support.report_page import page


def test_the_page_is_self_contained_and_escapes_what_it_shows():
    html = render(page())
    assert "A &lt;title&gt; &amp; more" in html
    assert "&lt;/script&gt;&lt;b&gt;" in html
    assert not re.search(r'(?:src|href)="(?:https?:)?//', html)
    assert 'href="#tables"' in html
    assert 'id="tables"' in html
    assert html.count("<script") == html.count("</script>")


@pytest.mark.parametrize("kind", ["replay", "worlds"])
def test_no_word_of_a_picture_leaves_its_script_element(kind):
    words = {"name": "<!--<script></script><b>"}
    card = Card("one", **{kind: words})
    html = render(Page(title="t", subtitle="", sections=[Section("s", [Cards("c", [card])])]))
    data = re.search(r'<script type="application/json">(.*?)</script>', html).group(1)
    assert "<" not in data
    assert json.loads(data) == words


def test_questions_come_with_answers_and_verdicts_fold_their_numbers():
    html = render(page())
    assert "<dt>Is it safe?</dt><dd>No.</dd>" in html
    verdict = html[html.index('class="verdict supported"') :]
    shown, folded = verdict.split("<details>", 1)
    assert "These runs show it." in shown
    assert "+3, p = 0.01" not in shown
    assert "+3, p = 0.01" in folded.split("</details>", 1)[0]


def test_long_tables_and_definitions_are_folded_away_under_their_name():
    long = Table([("metric", "")], [[Cell("contacts")]], "Every metric", folded=True)
    words = Definitions([("contacts", "", "of the ego"), ("min_ttc_s", "s", "least")])
    html = render(Page(title="t", subtitle="", sections=[Section("s", [long, words])]))
    assert '<details class="folded"><summary>Every metric</summary>' in html
    assert html.count("Every metric</") == 1, "the caption stands once"
    assert "<summary>2 columns of the results and what they mean</summary><dl" in html
    assert html.count("<details") == html.count("</details>") == 2


def test_a_report_is_replaced_only_by_a_complete_one(tmp_path, monkeypatch):
    path = tmp_path / "report.html"
    write_page(page(), path)
    before = path.read_text()

    def broken(_):
        raise OSError("disk full")

    monkeypatch.setattr("skidpad.report.elements.page.render", broken)
    with pytest.raises(OSError, match="disk full"):
        write_page(page(), path)
    assert path.read_text() == before


def test_backticks_make_code_and_nothing_else_does():
    page = Page(title="t", subtitle="", sections=[Section("s", [Text("run `a <b>`, not <i>")])])
    assert "<p>run <code>a &lt;b&gt;</code>, not &lt;i&gt;</p>" in render(page)
    option = Page(title="t", subtitle="", sections=[Section("s", [Text("ask `--seeds 10`")])])
    assert '<code class="option">--seeds 10</code>' in render(option), "not broken after its dashes"


def test_a_number_and_its_unit_stay_on_one_line():
    told = "in 95 % of `drive 5 m` at 80 km/h, 12 s and 3 m/s² in 4 months"
    table = Table([("row", "")], [[Cell("2 km", note="[1, 9] 7 mm")]], caption="20 m on")
    figure = Figure("<svg><text>30 m</text></svg>", "95 % of 100 km")
    code = Code("as it stands", "wait 5 s")
    blocks = [Text(told), table, figure, code]
    html = render(Page(title="t", subtitle="3 s", sections=[Section("s", blocks)]))
    joined = "in 95~% of <code>drive 5 m</code> at 80~km/h, 12~s and 3~m/s² in 4 months"
    for part in (
        f"<p>{joined}</p>", ">2~km<", "[1, 9] 7~mm", "<figcaption>20~m on<",
        "<figcaption>95~% of 100~km<", "<svg><text>30 m</text></svg>", "<pre>wait 5 s</pre>",
        ">3~s<",
    ):  # fmt: skip
        assert part.replace("~", "\u00a0") in html, part
    assert table.csv_uri() in html
    assert "2 km" in table.csv()
