"""A random walk over all controls of a drive, in a real browser, ends no drive."""

import os

from skidpad.campaign.runs.stored import read_run
from skidpad.core.inputs import Sky
from skidpad.physics.grip import grip_params
from skidpad.recording.run.inputs import read_inputs
from support.cockpit.commands import PATIENCE, running

STEPS = int(os.environ.get("SKIDPAD_WALK", "1000"))
WAIT = 1000.0 * PATIENCE  # ms
# buttons but `end`, switches, sliders, choices and keys, in an order that the seed decides
WALK = """async ([steps, seed]) => {
    let s = seed; const rand = (n) => { s = (Math.imul(s, 1664525) + 1013904223) >>> 0; return s % n; };
    const all = (q) => [...document.querySelectorAll(q)];
    const rest = (ms) => new Promise((done) => setTimeout(done, ms));
    const key = (to, key, code) => to.dispatchEvent(
        new KeyboardEvent('keydown', { key, keyCode: code, bubbles: true, cancelable: true }));
    const seen = { button: 0, toggle: 0, slider: 0, option: 0, key: 0 };
    for (let k = 0; k < steps; k++) {
        if (document.querySelector('.cockpit')?.dataset.ended) return { ...seen, ended: k };
        const kind = rand(10);
        if (kind < 3) {
            const found = all('.panel button:not(.say-end)');
            found[rand(found.length)].click(); seen.button++;
        } else if (kind < 5) {
            const found = all('.panel .q-toggle');
            found[rand(found.length)].click(); seen.toggle++;
        } else if (kind < 7) {
            const found = all('.panel .q-slider__track-container'); const one = found[rand(found.length)];
            const code = 33 + rand(2);  // a page up or down, many at once
            one.focus(); for (let i = rand(6); i >= 0; i--) key(one, '', code);
            one.dispatchEvent(new KeyboardEvent('keyup', { keyCode: code, bubbles: true }));
            seen.slider++;
        } else if (kind < 9) {
            const found = all('.panel .q-select .q-field__native, .panel .q-select .q-field__control');
            found[rand(found.length)].click(); await rest(40);
            const items = all('.q-menu .q-item');
            if (items.length) { items[rand(items.length)].click(); seen.option++; }
            await rest(20);
        } else {
            const keys = 'wsadmlnhctyug1234567'; const one = keys[rand(keys.length)];
            key(document.body, one, one.toUpperCase().charCodeAt(0));
            document.body.dispatchEvent(new KeyboardEvent('keyup', { key: one, bubbles: true }));
            seen.key++;
        }
        if (k % 4 === 0) await rest(30);  // so that most of it is seen by the drive
    }
    return seen; }"""


def choose(page, name, wanted):
    page.get_by_role("combobox", name=name).click()
    page.get_by_role("option", name=wanted, exact=True).click()


def test_no_walk_over_the_controls_ends_a_drive(browser, tmp_path):
    folder, errors = tmp_path / "run", []
    words = ["drive", "--no-browser", "--out", folder, "--vehicles", "4", "--sensors", "objects"]
    with running(*words, "--map", "straight", cwd=tmp_path) as command:
        context = browser.new_context(viewport={"width": 1280, "height": 900})
        context.set_default_timeout(WAIT)
        page = context.new_page()
        page.on("pageerror", lambda error: errors.append(str(error)))
        page.goto(command.address())
        page.wait_for_function(
            "() => document.querySelector('.stage canvas')?.width === 800", timeout=WAIT
        )
        choose(page, "grip", "statistical")
        page.get_by_text("the published formula for wet and icy roads").wait_for()
        choose(page, "weather (N)", "Packed snow")
        page.get_by_text("needs the physical grip model").wait_for()
        page.get_by_text("pictures (G)").click()
        seen = {}
        for first in range(0, STEPS, 500):
            part = page.evaluate(WALK, [min(500, STEPS - first), 1 + first])
            seen = {name: seen.get(name, 0) + n for name, n in part.items()}
            assert command.process.poll() is None
        page.get_by_role("button", name="end").click()
        status, said = command.ended()
        context.close()
    assert status == 0, said
    assert "completed after" in said, said
    assert errors == []
    assert min(seen.values()) > STEPS // 50, seen
    done = [timed.input for timed in read_inputs(folder, read_run(folder).inputs)]
    skies = [one for one in done if isinstance(one, Sky)]
    assert len(skies) > STEPS // 100, len(skies)
    for sky in skies:
        grip_params(sky.weather, sky.grip)
