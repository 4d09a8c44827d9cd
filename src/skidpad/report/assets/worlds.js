// Worlds of channels from above. Data: {dt, unit, span, t0, mark, hazard: [first, last], names, driving,
// involved: [[x, y]], cycles: [[world per channel]]}; world: [ego, plan, objects, predictions] or null;
// a box is [x, y, heading in mrad, length, width], a line [x, y, ...], all in `unit` metres.
for (const figure of document.querySelectorAll(".worlds")) {
  const canvas = figure.querySelector("canvas"), own = figure.querySelector("script");
  const data = own ? JSON.parse(own.textContent) : window.skidpadReplays?.[figure.id];
  if (!data) { figure.append("the data of this replay is missing"); continue; }
  const colours = ["#ff5b52", "#4fce7f", "#f2b441", "#b58cff"], ego = "#4d9dff";
  const n = data.names.length, panels = n + 1, side = 420, u = data.unit, last = data.cycles.length - 1;
  const bar = document.createElement("div"), button = document.createElement("button");
  const slider = document.createElement("input"), clock = document.createElement("small");
  bar.className = "bar"; slider.type = "range"; slider.min = 0; slider.max = last; slider.step = 1;
  slider.setAttribute("aria-label", "time"); button.textContent = "play";
  bar.append(button, slider, clock); canvas.after(bar);
  canvas.width = side * panels; canvas.height = side;
  const c = canvas.getContext("2d");
  let k = Math.min(data.mark, last), timer = null;
  const line = (points, colour, width, dash) => {
    c.beginPath(); c.strokeStyle = colour; c.lineWidth = width; c.setLineDash(dash);
    for (let i = 0; i + 1 < points.length; i += 2) c.lineTo(points[i] * u, points[i + 1] * u);
    c.stroke(); c.setLineDash([]);
  };
  const place = (b, paint) => { c.save(); c.translate(b[0] * u, b[1] * u); c.rotate(b[2] / 1000); paint(b[3] * u, b[4] * u); c.restore(); };
  const world = (w, colour) => {
    w[3].forEach(p => line(p, colour + "bb", .3, [.8, .8]));
    w[2].forEach(b => place(b, (l, v) => {
      c.strokeStyle = colour; c.lineWidth = .4; c.strokeRect(-l / 2, -v / 2, l, v);
      c.fillStyle = colour + "30"; c.fillRect(-l / 2, -v / 2, l, v);
      c.fillStyle = colour; c.fillRect(l / 2 - .5, -v / 2, .5, v);
    }));
    line(w[1], colour, .55, []);
    place(w[0], (l, v) => {
      c.strokeStyle = colour; c.lineWidth = .25; c.strokeRect(-l / 2, -v / 2, l, v);
      c.fillStyle = ego; c.beginPath(); c.moveTo(l / 2, 0); c.lineTo(-l / 2, v / 2); c.lineTo(-l / 3, 0); c.lineTo(-l / 2, -v / 2); c.fill();
    });
  };
  const draw = () => {
    const worlds = data.cycles[k], first = worlds.find(w => w);
    c.setTransform(1, 0, 0, 1, 0, 0); c.fillStyle = "#10151b"; c.fillRect(0, 0, canvas.width, side);
    for (let p = 0; p < panels; p++) {
      c.save(); c.setTransform(1, 0, 0, 1, 0, 0); c.beginPath(); c.rect(p * side + 2, 0, side - 4, side); c.clip();
      c.fillStyle = "#171e26"; c.fillRect(p * side + 2, 0, side - 4, side);
      const focus = (p < n ? worlds[p] : first) ?? first;
      if (focus) {
        const e = focus[0], scale = side / data.span;
        c.translate(p * side + side * .36, side / 2); c.scale(scale, -scale); c.rotate(-e[2] / 1000); c.translate(-e[0] * u, -e[1] * u);
        c.strokeStyle = "#2a343f"; c.lineWidth = .15;
        for (const r of [10, 20, 30, 40, 50]) { c.beginPath(); c.arc(e[0] * u, e[1] * u, r, 0, 7); c.stroke(); }
        worlds.forEach((w, i) => { if (w && (p === n || p === i)) world(w, colours[i % 4]); });
        if (k >= data.hazard[0] && k <= data.hazard[1]) data.involved.forEach(([x, y]) => {
          if (Math.abs(k - data.mark) > 3) return;
          c.beginPath(); c.strokeStyle = "#fff"; c.lineWidth = .3; c.arc(x * u, y * u, 3.4, 0, 7); c.stroke();
        });
      }
      c.setTransform(1, 0, 0, 1, 0, 0); c.font = "600 15px system-ui, sans-serif";
      c.fillStyle = p < n ? colours[p % 4] : "#e6eaef";
      const text = p < n ? data.names[p] + (p === data.driving ? " (driving)" : "") : "all worlds together";
      c.fillText(text + (p < n && !worlds[p] ? ": absent" : ""), p * side + 14, 25); c.restore();
    }
    const state = k >= data.hazard[0] && k <= data.hazard[1] ? (k === data.mark ? " · worst" : " · hazard") : "";
    slider.value = k; clock.textContent = (data.t0 + k * data.dt).toFixed(1) + " s" + state;
  };
  const stop = () => { clearInterval(timer); timer = null; button.textContent = "play"; };
  button.addEventListener("click", () => {
    if (timer) return stop();
    if (k >= last) k = 0;
    button.textContent = "pause";
    timer = setInterval(() => { k += 1; if (k >= last) { k = last; stop(); } draw(); }, 1000 * data.dt);
  });
  slider.addEventListener("input", () => { stop(); k = Number(slider.value); draw(); });
  draw();
}
