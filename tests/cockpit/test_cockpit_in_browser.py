"""The cockpit in a real browser: keys, switches, taking over, two tabs, replay."""

import os
import re
import shutil
from dataclasses import replace
from time import sleep

import pytest
from PIL import Image

from skidpad.campaign.campaign import Campaign
from skidpad.campaign.driving.loop import Timer
from skidpad.campaign.driving.run_setup import stage_of
from skidpad.campaign.recipes.matrix import RECIPE
from skidpad.campaign.runs.desk_run import drive_at_desk
from skidpad.campaign.runs.rerun import desk_of, first_ticks
from skidpad.campaign.runs.run import run
from skidpad.campaign.runs.stored import read_run
from skidpad.campaign.takeover.desk import Desk, Recorded
from skidpad.campaign.workers.pool import local
from skidpad.cockpit.bridge import ASLEEP_AFTER
from skidpad.cockpit.hud import TIERS
from skidpad.cockpit.replay import RecordedRun
from skidpad.core.inputs import Functions, Lamps, Method, Pedals, Sky, Timed, Wheel
from skidpad.core.run import Function
from skidpad.core.vocabulary import GripModel, RangeModel
from skidpad.physics.presets import preset
from skidpad.recording.campaign.folder import RUNS, SNAPSHOTS
from skidpad.recording.campaign.ledger import LEDGER
from skidpad.recording.run.inputs import read_inputs
from skidpad.recording.run.log_files import log_hash, read_log
from skidpad.recording.run.readings import RecordedSensor, tabulate_readings, write_readings
from support.cockpit.commands import PATIENCE, running
from support.runs import adas_run

GAMEPAD = """() => { const pad = { connected: true, id: "pad", axes: [0.5, 0, 0, 0],
    buttons: Array.from({ length: 16 }, (_, i) => ({ value: i === 7 ? 0.4 : 0 })) };
    window.readings = 0; navigator.getGamepads = () => window.readings++ < LAST ? [pad] : []; }"""
WHEEL = """() => { const wheel = { connected: true, id: "G29 Driving Force Racing Wheel",
    axes: [-0.25, 0, 0.2, 0, 0, 0], buttons: [] }; navigator.getGamepads = () => [wheel]; }"""
WAIT = 1000.0 * PATIENCE  # ms
SMALL = ["left", "rear", "right", "top", "depth", "semantic", "radar"]
DRAG = """([from, to]) => { const view = (v) => document.querySelector(`figure[data-view=${v}]`);
    view(from).dispatchEvent(new DragEvent('dragstart', { bubbles: true }));
    view(to).dispatchEvent(new DragEvent('drop', { bubbles: true, cancelable: true })); }"""
PLACES = "() => [...document.querySelectorAll('.cockpit figure')].map((f) => f.dataset.view)"
PICTURES = os.environ.get("SKIDPAD_PICTURES")  # a folder for screenshots, to be looked at
LATE = """() => { const real = window.createImageBitmap; window.late = 'not yet';
    window.createImageBitmap = async (blob) => { window.createImageBitmap = real; window.late = 'soon';
        await new Promise((done) => setTimeout(done, 6000)); window.late = 'now'; return real(blob); }; }"""
THROTTLE = "parseFloat(document.querySelector('.pedals .throttle').style.height)"  # percent
BRAKE_PAD = "parseFloat(document.querySelector('[data-touch=brake] i').style.height)"  # percent
FINGER = """([name, type, x, y]) => { const pad = document.querySelector(`[data-touch=${name}]`);
    const box = pad.getBoundingClientRect(); pad.setPointerCapture = () => {};
    pad.dispatchEvent(new PointerEvent(type, { bubbles: true, cancelable: true, pointerId: 7,
    clientX: box.left + x * box.width, clientY: box.top + y * box.height })); }"""
# columns of a canvas, in px of the page, in which a colour stands between two heights
COLUMNS = """([selector, top, low, ink]) => { const c = document.querySelector(selector), found = [];
    const k = c.width / c.clientWidth, high = Math.round((low - top) * k);
    const d = c.getContext('2d').getImageData(0, Math.round(top * k), c.width, high).data;
    for (let i = 0; i < d.length; i += 4)
        if (ink.every((v, j) => Math.abs(d[i + j] - v) < 20)) found.push(Math.floor(i / 4 % c.width / k));
    return [...new Set(found)]; }"""
# keeps what was last written on each canvas, and where: text, left, top, right, bottom
WRITTEN = """() => { window.written = {}; const on = CanvasRenderingContext2D.prototype;
    const { clearRect, fillText } = on, of = (g) => g.canvas.parentElement.className;
    on.clearRect = function (...box) { window.written[of(this)] = []; return clearRect.apply(this, box); };
    on.fillText = function (text, x, y) { const m = this.measureText(text);
        (window.written[of(this)] ||= []).push([String(text), x - m.actualBoundingBoxLeft,
            y - m.actualBoundingBoxAscent, x + m.actualBoundingBoxRight, y + m.actualBoundingBoxDescent]);
        return fillText.call(this, text, x, y); }; }"""
LEFT, RIGHT, ROW, PLOT, HEAD = 34, 12, 58, 36, 34  # px of the plots, as cockpit.js lays them out
GAP_INK, LIMIT_INK, BESIDE_INK = (0x4F, 0xCE, 0x7F), (0xFF, 0x85, 0x52), (0xC9, 0xD1, 0xD9)
ENVELOPE = RecordedSensor("envelope", "envelope", "Speed envelope", "m/s; binding: 0 none, 1 sight")
PAUSED = "() => document.querySelector('.cockpit').dataset.paused === 'true'"
FACT = """name => [...document.querySelectorAll('.cockpit dt')]
    .find(dt => dt.textContent === name)?.nextElementSibling.textContent"""


def until(page, script, value=None):
    """Wait for a condition, however busy the machine is."""
    page.wait_for_function(script, arg=value, timeout=WAIT)


def until_fact(page, name, wanted):
    until(page, f"([name, wanted]) => ({FACT})(name)?.includes(wanted)", [name, wanted])


def opened(browser, address, errors):
    context = browser.new_context(viewport={"width": 1280, "height": 900})
    context.set_default_timeout(WAIT)
    page = context.new_page()
    page.on("pageerror", lambda error: errors.append(str(error)))
    page.goto(address)
    until(page, "() => document.querySelector('.stage canvas')?.width === 800")
    return context, page


def inked(page, row, ink):
    """Columns of a plot of the time line in which its curve stands; names and numbers are outside."""
    low = HEAD + (row + 1) * ROW - 4
    return set(page.evaluate(COLUMNS, [".line canvas", low - PLOT, low, list(ink)]))


def column_of(page, share):
    """The px of the time line at which a share of its time has passed."""
    return LEFT + share * (page.locator(".line canvas").bounding_box()["width"] - LEFT - RIGHT)


def go_to(page, share):
    """Click the time line where a share of its time has passed."""
    line = page.locator(".line canvas")
    line.scroll_into_view_if_needed()
    line.click(position={"x": column_of(page, share), "y": 20})


def labels_of(page, place):
    """The labels of a canvas that were drawn last; none covers another one, and all lie on it."""
    written = page.evaluate("place => window.written[place]", place)
    width, height = page.evaluate(
        "p => { const c = document.querySelector(`.${p} canvas`); return [c.clientWidth, c.clientHeight]; }",
        place,
    )
    for i, (text, left, top, right, low) in enumerate(written):
        assert min(left, top, width - right, height - low) >= -1, f"{text!r} is cut off"
        for other, left_2, top_2, right_2, low_2 in written[:i]:
            apart = right <= left_2 or right_2 <= left or low <= top_2 or low_2 <= top
            assert apart, f"{text!r} covers {other!r} in {width} px"
    return [text for text, *_ in written]


def photograph(page, name):
    if PICTURES:
        page.screenshot(path=f"{PICTURES}/{name}.png", full_page=True)


def picture_of(page, selector=".stage canvas"):
    """Mean brightness and spread of a canvas: something is on it."""
    return page.evaluate(
        """selector => { const c = document.querySelector(selector);
        const d = c.getContext('2d').getImageData(0, 0, c.width, c.height).data; let s = 0, q = 0, n = 0;
        for (let i = 0; i < d.length; i += 4 * 97) { s += d[i]; q += d[i] * d[i]; n++; }
        return [s / n, Math.sqrt(q / n - (s / n) ** 2)]; }""",
        selector,
    )


@pytest.mark.req("A-219", "A-271", "A-272", "A-273", "A-274")
def test_a_person_drives_in_a_browser_and_the_run_can_be_driven_again(browser, tmp_path):
    folder, errors = tmp_path / "run", []
    words = ["drive", "--no-browser", "--out", folder, "--vehicles", "6", "--sensors", "objects"]
    words += ["--weather", "clear-noon"]
    with running(*words, cwd=tmp_path) as command:
        context, page = opened(browser, command.address(), errors)
        assert "token" not in page.url
        until_fact(page, "drives", "the stack")
        assert picture_of(page)[1] > 10.0
        facts = set(page.locator(".facts dt").all_text_contents())
        assert {"status", "distance", "time gap", "radar limit", "weather", "real time", "on",
                "collisions", "drives"} <= facts  # fmt: skip
        assert page.locator(".tiers li").all_text_contents() == list(TIERS)
        assert page.locator(".tiers li.lit").count() == 1
        # one key lists all keys
        keys = page.locator(".keys")
        assert keys.count() == 0
        page.keyboard.press("?")
        keys.get_by_text("take over the wheel, hand it back").wait_for()
        page.keyboard.press("Escape")
        keys.wait_for(state="detached")
        # how far to a stop stands as large as the speed, and is what braking on this grip takes
        until(page, "() => +document.querySelector('.speed b').textContent > 20")
        sizes = page.evaluate(
            "['.speed b', '.stop b'].map(s => getComputedStyle(document.querySelector(s)).fontSize)"
        )
        assert sizes[0] == sizes[1]
        speed, way, grip = page.evaluate(
            "['.speed b', '.stop b', '.stop small:last-child']"
            ".map(s => document.querySelector(s).textContent)"
        )
        assert float(way) == pytest.approx(
            (float(speed) / 3.6) ** 2 / (2.0 * 9.81 * float(grip.split()[1])), abs=1.0
        )
        # keys T, Y, U hide and show views
        depth = "() => document.querySelectorAll('.side figure')[1].style.display"
        page.keyboard.press("t")
        until(page, f"() => ({depth})() === 'none'")
        page.keyboard.press("t")
        until(page, f"() => ({depth})() === ''")
        # a second tab watches, and its words do not count
        watcher = context.new_page()
        watcher.goto(page.url)
        until(watcher, "() => document.querySelector('.bar').textContent.includes('watches')")
        watcher.keyboard.press("m")
        until(
            watcher, "() => document.querySelector('.cockpit').dataset.wrong?.includes('another')"
        )
        watcher.close()
        page.bring_to_front()
        # take over and drive by keys
        page.keyboard.press("m")
        until_fact(page, "drives", "you, by keyboard")
        page.keyboard.down("w")
        until(page, "() => +document.querySelector('.speed b').textContent > 3")
        page.keyboard.down("a")
        until(page, "() => parseFloat(document.querySelector('.steer i').style.left) < 49.9")
        page.keyboard.up("a")
        page.keyboard.up("w")
        # a gamepad is missed when it is gone, even after a single reading
        unplugged = "() => document.querySelector('.cockpit').dataset.wrong?.includes('unplugged')"
        page.evaluate(GAMEPAD.replace("LAST", "1"))
        until(page, unplugged)
        page.evaluate("document.querySelector('.cockpit').dataset.wrong = ''")
        # a gamepad is noticed by itself, and says so; what is said lags behind what is read
        page.evaluate(GAMEPAD.replace("LAST", "Infinity"))
        until(page, "() => window.readings > 0")
        until_fact(page, "drives", "you, by gamepad")
        page.evaluate("navigator.getGamepads = () => []")
        until(page, unplugged)
        until_fact(page, "drives", "you, by keyboard")
        # a wheel has axes of its own: a pedal that was never moved says 0, half the way, and is released
        page.evaluate(WHEEL)
        until_fact(page, "drives", "you, by wheel")
        page.evaluate("navigator.getGamepads = () => []")
        until_fact(page, "drives", "you, by keyboard")
        # headlights, weather, functions by keys and by switches
        page.keyboard.press("l")
        until(page, "() => document.querySelector('.lamp').textContent.includes('low')")
        page.keyboard.press("n")
        until_fact(page, "weather", "clear-night")
        page.keyboard.press("h")  # the time of day alone
        until_fact(page, "weather", "clear-sunrise")
        page.get_by_text("pictures (G)").click()
        # by key: while the panel still slides open, a click may fall beside a switch
        page.get_by_role("switch", name="clouds").press("Space")
        until(page, "() => !document.querySelector('.cockpit').dataset.extras.includes('clouds')")
        page.get_by_role("switch", name="limiter (5)").press("Space")
        until_fact(page, "on", "limiter")
        page.keyboard.press("m")
        until_fact(page, "drives", "the stack")
        photograph(page, "drive")
        # a minute of driving, as fast as it can
        page.get_by_role("combobox", name="speed").click()
        page.get_by_role("option", name="as fast as it can").click()
        until(page, f"() => parseFloat(({FACT})('time')) > 60")
        page.set_viewport_size({"width": 390, "height": 844})
        photograph(page, "drive-390")
        width = page.evaluate("document.documentElement.scrollWidth")
        assert width <= 390, "the page is wider than a phone"
        page.get_by_role("button", name="end").click()
        status, said = command.ended()
        context.close()
    assert status == 0, said
    assert "completed after" in said
    assert errors == []
    spec = read_run(folder)
    done = [timed.input for timed in read_inputs(folder, spec.inputs)]
    assert {Wheel(True), Wheel(False)} <= set(done)
    kinds = {type(one) for one in done}
    assert {Pedals, Lamps, Sky, Functions} <= kinds
    assert Pedals(throttle=0.4, steer=-0.5, method=Method.GAMEPAD) in done
    assert Pedals(throttle=0.4, steer=0.25, method=Method.WHEEL) in done
    last = next(one for one in reversed(done) if isinstance(one, Functions))
    assert Function.LIMITER in last.on
    stored = read_log(folder)
    stage = stage_of(spec)
    stage = replace(stage, script=Timer(len(stored), stage.script))
    again = run(spec, stage=stage, desk=desk_of(folder, spec)).log
    n = len(stored)
    assert log_hash(first_ticks(again, n)) == log_hash(first_ticks(stored, n))


@pytest.fixture(scope="module")
def stored(tmp_path_factory):
    """Six seconds on objects, in which a person takes over and night falls."""
    folder = tmp_path_factory.mktemp("replay") / "run"
    wanted = adas_run(3, "clear-noon", duration=6.0, seed=4, vehicles=6)
    night = Sky(preset("clear-night"), GripModel.PHYSICAL, RangeModel.PHYSICAL)
    inputs = [Timed(40, Wheel(True)), Timed(60, night), Timed(80, Wheel(False))]
    drive_at_desk(wanted, Desk(Recorded(inputs), wanted), folder)
    # as of a run in which the envelope said nothing for the middle third
    limits = [None if 40 <= tick < 80 else 20.0 for tick in range(len(read_log(folder)))]
    rows = [
        {"tick": tick, "envelope.speed_mps": v, "envelope.binding": 1.0}
        for tick, v in enumerate(limits)
    ]
    write_readings(folder, tabulate_readings({ENVELOPE.id: ENVELOPE}, rows))
    return folder


def test_the_run_beside_has_its_curves_in_each_plot(browser, stored, tmp_path):
    wanted = adas_run(3, "clear-noon", duration=4.0, seed=4, vehicles=6)
    braked = Recorded([Timed(20, Wheel(True)), Timed(20, Pedals(brake=1.0))])
    drive_at_desk(wanted, Desk(braked, wanted), tmp_path / "braked")
    errors = []
    words = ["replay", stored, "--beside", tmp_path / "braked", "--no-browser"]
    with running(*words, cwd=tmp_path) as command:
        context, page = opened(browser, command.address(), errors)
        page.keyboard.press("p")
        until(page, PAUSED)
        page.evaluate(WRITTEN)
        for width in (390, 1280):
            page.set_viewport_size({"width": width, "height": 900})
            until(page, "() => window.written.line?.length")
            assert sum(text.startswith("beside ") for text in labels_of(page, "line")) == 4
            page.evaluate("window.written = {}")
            photograph(page, f"beside-{width}")
        there = inked(page, 0, BESIDE_INK)
        assert len(there) > 100
        assert max(there) < column_of(page, 4.2 / 6.0), "it ends with its run"
        page.get_by_role("button", name="end").click()
        status, said = command.ended()
        context.close()
    assert status == 0, said
    assert errors == []


@pytest.mark.req("A-271", "A-275")
def test_a_run_is_scrubbed_through_in_a_browser(browser, stored, tmp_path):
    errors = []
    with running("replay", stored, "--beside", stored, "--no-browser", cwd=tmp_path) as command:
        context, page = opened(browser, command.address(), errors)
        page.keyboard.press("p")
        until(page, PAUSED)
        # plots under the time line: curves where there are values and nowhere else
        curves = RecordedRun(stored).curves()
        for row, values, ink in ((0, curves.limit, LIMIT_INK), (1, curves.gap, GAP_INK)):
            there = inked(page, row, ink)
            for k in range(4, len(values) - 4):
                near = {value is None for value in values[k - 4 : k + 5]}
                column = round(column_of(page, k / (len(values) - 1)))
                around = there & {column - 1, column, column + 1}
                assert near == {True, False} or bool(around) == (near == {False}), (row, k)
        assert inked(page, 3, (0xF2, 0xB4, 0x41)), "grip"
        # numbers at the ends of all axes, at every width, and no label over another one
        page.evaluate(WRITTEN)
        for width in (390, 1280):
            page.set_viewport_size({"width": width, "height": 900})
            until(page, "() => window.written.line?.length && window.written.strips?.length")
            until(page, "() => document.querySelector('.line canvas').width <= innerWidth")
            assert page.evaluate("document.documentElement.scrollWidth") <= width
            wide = page.evaluate(
                "Math.min(...[...document.querySelectorAll('.facts dd')].map(d => d.clientWidth))"
            )
            assert wide > 30, "facts stand in lines"
            labels = labels_of(page, "line")
            assert {"speed, km/h", "gap to what is ahead, m", "grip of the tyres"} <= set(labels)
            assert {"80", "10", "1", "6 s"} <= set(labels)
            assert labels.count("0") >= 5
            assert {"speed, km/h", "-30", "0 s"} <= set(labels_of(page, "strips"))
            photograph(page, f"plots-{width}")
            page.evaluate("window.written = {}")
        go_to(page, 0.25)
        until_fact(page, "time", "1.50 s")
        day = picture_of(page)[0]
        # the address names the moment, and opens it again
        until(page, "() => location.hash === '#t=1.5'")
        page.keyboard.press("p")
        page.goto(page.url.replace("#t=1.5", "#t=2.5"))
        page.reload()
        until_fact(page, "time", "2.50 s")
        until(page, PAUSED)
        go_to(page, 0.25)
        until_fact(page, "time", "1.50 s")
        page.keyboard.press("ArrowRight")
        until_fact(page, "time", "1.55 s")
        go_to(page, 0.6)
        until_fact(page, "drives", "you")
        until_fact(page, "weather", "clear-night")
        assert picture_of(page)[0] < 0.6 * day
        assert picture_of(page)[1] > 3.0
        # the same run beside it is as old and shows as much; additions go with one key
        until(page, "() => document.querySelector('.beside canvas').width === 800")
        assert "clear-night" in page.locator(".beside .mode").text_content()
        assert picture_of(page, ".beside canvas") == picture_of(page)
        night = picture_of(page)
        page.keyboard.press("g")
        until(page, "() => document.querySelector('.cockpit').dataset.extras === ''")
        assert picture_of(page) != night
        page.keyboard.press("g")
        photograph(page, "replay")
        # views change places, and stay there when the page is opened again
        assert page.evaluate(PLACES) == SMALL
        page.evaluate(DRAG, ["left", "depth"])
        swapped = ["depth", "rear", "right", "top", "left", "semantic", "radar"]
        until(page, f"wanted => ({PLACES})().join() === wanted", ",".join(swapped))
        page.reload()
        until(page, "() => document.querySelector('figure[data-view=left] canvas')?.width === 280")
        assert page.evaluate(PLACES) == swapped
        assert picture_of(page, ".side figure[data-view=left] canvas")[1] > 3.0
        for _ in range(3):
            page.keyboard.press("c")
        until(page, "() => document.querySelector('.cockpit').dataset.main === 'crash'")
        assert picture_of(page)[1] > 3.0
        page.set_viewport_size({"width": 390, "height": 844})
        assert page.evaluate("document.documentElement.scrollWidth") <= 390
        page.get_by_role("button", name="end").click()
        status, said = command.ended()
        context.close()
    assert status == 0, said
    assert errors == []


def test_a_campaign_is_watched_in_a_browser(browser, tmp_path):
    cells = [adas_run(2, "clear-noon", duration=1.0, seed=s, vehicles=2) for s in (1, 2)]
    Campaign(RECIPE, cells).run(tmp_path, local(1))
    with running("watch", tmp_path, "--no-browser", cwd=tmp_path) as command:
        context = browser.new_context(viewport={"width": 390, "height": 844})
        context.set_default_timeout(WAIT)
        page = context.new_page()
        page.goto(command.address())
        page.get_by_text("adas: 2 of 2 runs done; 2 completed").wait_for()
        page.get_by_text("0.16 to 1.00").wait_for()
        page.get_by_text("worst crash: none").wait_for()
        assert page.evaluate("document.documentElement.scrollWidth") <= 390
        ledger = tmp_path / LEDGER  # a run more while the page is open
        line = ledger.read_text().splitlines()[0]
        line = re.sub("-00[12]", "-003", re.sub(',"sum":"[0-9a-f]+"', "", line))
        ledger.write_text(
            ledger.read_text() + line.replace('"fatal_collisions":0', '"fatal_collisions":1') + "\n"
        )
        page.get_by_text("adas: 3 of 2 runs done").wait_for()
        page.get_by_text("worst crash: 2_clear-noon-003").wait_for()
        assert not page.locator(".q-img").is_visible()  # no picture was taken of it
        # of crashes at speeds that are not known the newest; the last picture of its run
        folder = tmp_path / RUNS / "2_clear-noon-004" / SNAPSHOTS
        folder.mkdir(parents=True)
        for second, size in ((9.5, (8, 6)), (12.25, (80, 60))):
            Image.new("RGB", size, "red").save(folder / f"2_clear-noon_{second:07.2f}s.png")
        line = ledger.read_text().splitlines()[-1]
        ledger.write_text(ledger.read_text() + line.replace("-003", "-004") + "\n")
        page.get_by_text(
            re.compile(
                "worst crash: 2_clear-noon-004.*before its fastest crash.*last picture of that run"
            )
        ).wait_for()
        until(page, "() => document.querySelector('.q-img img')?.naturalWidth === 80")
        # of a run whose log is there a film, from before the crash on
        shutil.copytree(tmp_path / RUNS / "2_clear-noon-001", tmp_path / RUNS / "2_clear-noon-005")
        ledger.write_text(ledger.read_text() + line.replace("-003", "-005") + "\n")
        page.get_by_text(
            re.compile("worst crash: 2_clear-noon-005.*; film from 5 s before it")
        ).wait_for()
        until(page, "() => document.querySelector('.q-img img')?.naturalWidth === 480")
        assert page.evaluate("document.documentElement.scrollWidth") <= 390
        photograph(page, "watch-390")
        context.close()


@pytest.mark.req("A-274")
def test_a_picture_that_is_late_is_not_shown_over_a_newer_one(browser, tmp_path):
    words = ["drive", "--no-browser", "--vehicles", "2", "--sensors", "objects"]
    with running(*words, "--out", tmp_path / "run", cwd=tmp_path) as command:
        context, page = opened(browser, command.address(), [])
        page.evaluate(LATE)  # one picture of a moment before the pause takes 6 s to decode
        until(page, "() => window.late === 'soon'")
        page.keyboard.press("p")
        until(page, "() => window.late === 'now'")
        until(page, PAUSED)
        sleep(2.0)
        assert page.evaluate(PAUSED)
        context.close()


@pytest.mark.req("A-274")
def test_a_page_that_is_put_to_sleep_lets_another_one_drive(browser, tmp_path):
    words = ["drive", "--no-browser", "--on-close", "pause", "--vehicles", "2", "--sensors"]
    with running(*words, "objects", "--out", tmp_path / "run", cwd=tmp_path) as command:
        context, page = opened(browser, command.address(), [])
        other = context.new_page()
        other.goto(page.url)
        until(other, "() => document.querySelector('.bar').textContent.includes('watches')")
        # all that runs in the page stops, its socket is open
        asleep = context.new_cdp_session(page)
        page.evaluate("window.same = true")
        asleep.send("Debugger.enable")
        asleep.send("Debugger.pause")
        until(other, "() => document.querySelector('.bar').textContent === 'this tab drives'")
        other.keyboard.press("m")
        until_fact(other, "drives", "you, by keyboard")
        # it wakes, watches, and drives again when the other one is closed
        asleep.send("Debugger.resume")
        until(page, "() => document.querySelector('.bar').textContent.includes('watches')")
        other.close()
        until(page, "() => document.querySelector('.bar').textContent === 'this tab drives'")
        # nobody is awake: the drive stands until somebody is there and says so
        asleep.send("Debugger.pause")
        sleep(2.0 * ASLEEP_AFTER)  # the server, too, may be busy
        asleep.send("Debugger.resume")
        sleep(3.0)  # a page that is loaded anew loses what was pressed meanwhile
        assert page.evaluate("window.same")
        until(page, PAUSED)
        page.keyboard.press("p")
        until(page, "() => document.querySelector('.cockpit').dataset.paused === 'false'")
        context.close()


@pytest.mark.req("A-274")
def test_a_person_drives_by_pedals_and_wheel_on_a_touch_screen(browser, tmp_path):
    folder, errors = tmp_path / "run", []
    words = ["drive", "--no-browser", "--out", folder, "--vehicles", "2", "--sensors", "objects"]
    with running(*words, cwd=tmp_path) as command:
        context = browser.new_context(
            viewport={"width": 844, "height": 800}, has_touch=True, is_mobile=True
        )
        context.set_default_timeout(WAIT)
        page = context.new_page()
        page.on("pageerror", lambda error: errors.append(str(error)))
        page.goto(command.address())
        until(page, "() => document.querySelector('.stage canvas')?.width === 800")
        page.get_by_role("button", name="take over / hand back").tap()
        until(page, "() => document.querySelector('.cockpit').classList.contains('manual')")
        until(
            page,
            "() => document.querySelector('[data-touch=throttle]').getBoundingClientRect().top > 0",
        )
        for name, x, y in (("throttle", 0.5, 0.25), ("steer", 0.25, 0.5)):
            page.evaluate(FINGER, [name, "pointerdown", x, y])
        until_fact(page, "drives", "you, by touch")
        until(page, f"() => {THROTTLE} === 75")
        photograph(page, "touch")
        for name in ("throttle", "steer"):
            page.evaluate(FINGER, [name, "pointerup", 0.5, 0.5])
        until(page, f"() => {THROTTLE} === 0")
        page.evaluate(FINGER, ["brake", "pointerdown", 0.5, 0.5])
        page.evaluate("() => window.dispatchEvent(new Event('blur'))")  # the page is left
        until(page, f"() => {BRAKE_PAD} === 0")
        page.get_by_role("button", name="end").tap()
        status, said = command.ended()
        context.close()
    assert status == 0, said
    assert errors == []
    done = [timed.input for timed in read_inputs(folder, read_run(folder).inputs)]
    touched = [p for p in done if isinstance(p, Pedals) and p.method is Method.TOUCH]
    assert 0.75 in {p.throttle for p in touched}
    assert 0.5 in {p.steer for p in touched}
