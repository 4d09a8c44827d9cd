// Top-down replays. Data: {dt, unit, lanes: [[x, y, ...]], walls: [[x, y, ...]], size: [[length, width]],
// patches: [[kind, [x, y, ...]]] where something lies on the road,
// ego: index, t0, mark: frame of the event, frames: [[x, y, yaw_mrad, ...per actor]], names: [...]};
// coordinates are integers in `unit` metres; an actor that is absent has null.
const SURFACES = {water: "#1d4f7c", ice: "#7fb8c9", snow: "#aab4bd", friction: "#6b4a78"};
for (const figure of document.querySelectorAll(".replay")) {
  const canvas = figure.querySelector("canvas"), data = JSON.parse(figure.querySelector("script").textContent);
  const bar = document.createElement("div"), button = document.createElement("button");
  const slider = document.createElement("input"), clock = document.createElement("small");
  bar.className = "bar"; slider.type = "range"; slider.min = 0; slider.max = data.frames.length - 1; slider.step = 1;
  slider.setAttribute("aria-label", "time"); button.textContent = "play";
  bar.append(button, slider, clock); canvas.after(bar);
  canvas.width = 640; canvas.height = 420;
  const c = canvas.getContext("2d"), u = data.unit, span = data.span ?? 70;
  let k = data.mark ?? 0, timer = null;
  const line = (points, colour, width) => {
    c.beginPath(); c.strokeStyle = colour; c.lineWidth = width;
    for (let i = 0; i < points.length; i += 2) c.lineTo(points[i] * u, points[i + 1] * u);
    c.stroke();
  };
  const fill = (points, colour) => {
    c.beginPath(); c.fillStyle = colour;
    for (let i = 0; i < points.length; i += 2) c.lineTo(points[i] * u, points[i + 1] * u);
    c.fill();
  };
  const draw = () => {
    const f = data.frames[k], e = 3 * data.ego, ex = f[e] * u, ey = f[e + 1] * u, yaw = f[e + 2] / 1000;
    const scale = canvas.width / span;
    c.setTransform(1, 0, 0, 1, 0, 0); c.fillStyle = "#10151b"; c.fillRect(0, 0, canvas.width, canvas.height);
    c.translate(canvas.width * .38, canvas.height / 2); c.scale(scale, -scale); c.rotate(-yaw); c.translate(-ex, -ey);
    for (const [kind, points] of data.patches ?? []) fill(points, SURFACES[kind]);
    for (const lane of data.lanes) line(lane, "#39444f", .15);
    for (const wall of data.walls ?? []) line(wall, "#8996a3", .3);
    data.size.forEach(([l, w], i) => {
      if (f[3 * i] === null || f[3 * i] === undefined) return;
      c.save(); c.translate(f[3 * i] * u, f[3 * i + 1] * u); c.rotate(f[3 * i + 2] / 1000);
      c.fillStyle = i === data.ego ? "#ff8552" : data.colours?.[i] ?? "#7db4ea";
      c.fillRect(-l / 2, -w / 2, l, w); c.fillStyle = "rgba(0,0,0,.45)"; c.fillRect(l / 4, -w / 2, l / 8, w); c.restore();
    });
    slider.value = k; clock.textContent = (data.t0 + k * data.dt).toFixed(1) + " s" + (k === data.mark ? " · contact" : "");
  };
  const stop = () => { clearInterval(timer); timer = null; button.textContent = "play"; };
  button.addEventListener("click", () => {
    if (timer) return stop();
    if (k >= data.frames.length - 1) k = 0;
    button.textContent = "pause";
    timer = setInterval(() => { k += 1; if (k >= data.frames.length) { k = data.frames.length - 1; stop(); } draw(); }, 1000 * data.dt);
  });
  slider.addEventListener("input", () => { stop(); k = Number(slider.value); draw(); });
  draw();
}
