// Top-down replays. Data: {dt, unit, lanes: [[x, y, ...]], walls: [[x, y, ...]], size: [[length, width]],
// patches: [[kind, [x, y, ...], from, to]] where something lies on the road, and when if events lay it,
// ego: index, t0, mark: frame of the event, label: what it is called, frames: [[x, y, yaw_mrad, ...per actor]],
// points: [[x, y, ...]] per frame, of a lidar}; coordinates are integers in `unit` metres; an actor that is absent
// has null. With pictures, an array of one per frame, these are shown instead.
// Data stands in the figure, or in skidpadReplays under the figure's id.
const SURFACES = {water: "#1d4f7c", ice: "#3c6674", snow: "#65707a", friction: "#6b4a78"};
for (const figure of document.querySelectorAll(".replay")) {
  const canvas = figure.querySelector("canvas"), own = figure.querySelector("script");
  const data = own ? JSON.parse(own.textContent) : window.skidpadReplays?.[figure.id];
  if (!data) { figure.append("the data of this replay is missing"); continue; }
  const last = (data.pictures ?? data.frames).length - 1;
  const bar = document.createElement("div"), button = document.createElement("button");
  const slider = document.createElement("input"), clock = document.createElement("small");
  bar.className = "bar"; slider.type = "range"; slider.min = 0; slider.max = last; slider.step = 1;
  slider.setAttribute("aria-label", "time"); button.textContent = "play";
  bar.append(button, slider, clock); canvas.after(bar);
  canvas.width = 640; canvas.height = data.pictures ? 480 : 420;
  const c = canvas.getContext("2d"), u = data.unit, span = data.span ?? 70;
  let k = data.mark ?? 0, timer = null, played = false;
  const images = (data.pictures ?? []).map((source, i) => Object.assign(new Image(), { src: source, onload: () => i === k && draw() }));
  const speed = i => {  // km/h, over half a second; before a contact, over what led to it
    if (!data.frames) return "";
    const e = 3 * data.ego, n = Math.max(Math.round(.25 / data.dt), 1), early = i === data.mark ? 1 : 0;
    const a = Math.max(i - n - early, 0), b = early ? Math.max(i - 1, 0) : Math.min(i + n, last);
    if (a === b) return "";
    const v = 3.6 * u * Math.hypot(data.frames[b][e] - data.frames[a][e], data.frames[b][e + 1] - data.frames[a][e + 1]) / ((b - a) * data.dt);
    return v < 400 ? ` · ${Math.round(v)} km/h` : "";
  };
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
  const caption = () => {
    const contact = k === data.mark && data.label !== "" ? " · " + (data.label ?? "contact") : "";
    slider.value = k; clock.textContent = (data.t0 + k * data.dt).toFixed(1) + " s" + contact + speed(k);
  };
  const draw = () => {
    if (data.pictures) { if (images[k].complete) c.drawImage(images[k], 0, 0, canvas.width, canvas.height); return caption(); }
    const f = data.frames[k], e = 3 * data.ego, ex = f[e] * u, ey = f[e + 1] * u, yaw = f[e + 2] / 1000;
    const scale = canvas.width / span;
    c.setTransform(1, 0, 0, 1, 0, 0); c.fillStyle = "#10151b"; c.fillRect(0, 0, canvas.width, canvas.height);
    c.translate(canvas.width * .38, canvas.height / 2); c.scale(scale, -scale); c.rotate(-yaw); c.translate(-ex, -ey);
    data.lanes.forEach((left, i) => {  // both borders of a lane follow each other
      const right = data.lanes[i + 1];
      if (i % 2 || !right) return;
      const back = []; for (let j = right.length - 2; j >= 0; j -= 2) back.push(right[j], right[j + 1]);
      fill([...left, ...back], "#1d252e");
    });
    const now = data.t0 + k * data.dt + 1e-6;
    for (const [kind, points, from = 0, to = Infinity] of data.patches ?? []) if (from <= now && now < to) fill(points, SURFACES[kind]);
    c.setLineDash([3, 2]); for (const lane of data.lanes) line(lane, "#5b6875", .15); c.setLineDash([]);
    for (const wall of data.walls ?? []) line(wall, "#8996a3", .3);
    const way = []; for (let i = 0; i <= k; i++) way.push(data.frames[i][e], data.frames[i][e + 1]);
    if (way.length > 2) line(way, "#ff855266", .25);
    data.size.forEach(([l, w], i) => {
      if (f[3 * i] === null || f[3 * i] === undefined) return;
      c.save(); c.translate(f[3 * i] * u, f[3 * i + 1] * u); c.rotate(f[3 * i + 2] / 1000);
      c.fillStyle = i === data.ego ? "#ff8552" : data.colours?.[i] ?? "#7db4ea";
      c.fillRect(-l / 2, -w / 2, l, w); c.fillStyle = "rgba(0,0,0,.45)"; c.fillRect(l / 4, -w / 2, l / 8, w); c.restore();
    });
    if (data.points) { c.fillStyle = "#f2b441"; const p = data.points[k]; for (let i = 0; i < p.length; i += 2) c.fillRect(p[i] * u - .12, p[i + 1] * u - .12, .24, .24); }
    caption();
  };
  const stop = () => { clearInterval(timer); timer = null; button.textContent = "play"; };
  button.addEventListener("click", () => {
    if (timer) return stop();
    if (k >= last || !played) k = 0;
    played = true;
    button.textContent = "pause";
    timer = setInterval(() => { k += 1; if (k >= last) { k = last; stop(); } draw(); }, 1000 * data.dt);
  });
  slider.addEventListener("input", () => { stop(); played = true; k = Number(slider.value); draw(); });
  draw();
}
