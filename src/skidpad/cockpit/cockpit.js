// The canvases of the cockpit: pictures come by websocket and are acknowledged when they are drawn.
const SMALL = ["left", "rear", "right", "top", "depth", "semantic"];
const TITLES = { left: "left mirror", rear: "rear", right: "right mirror", top: "top (U)", depth: "depth (T)",
  semantic: "classes (Y)", driver: "driver", follow: "follow", crash: "crash", radar: "radar, orange closing" };
const WORDS = { KeyM: ["take"], KeyL: ["lamps"], KeyN: ["weather"], KeyH: ["hour"], KeyP: ["pause"], KeyC: ["main"], KeyG: ["extra"],
  KeyT: ["hide", "depth"], KeyY: ["hide", "semantic"], KeyU: ["hide", "top"], Period: ["step", 1],
  Digit1: ["toggle", "acc"], Digit2: ["toggle", "lca"], Digit3: ["toggle", "tla"],
  Digit4: ["toggle", "resume"], Digit5: ["toggle", "limiter"], Digit6: ["toggle", "aeb"],
  Digit7: ["toggle", "bend"] };
const PEDALS = { KeyW: "up", ArrowUp: "up", KeyS: "down", ArrowDown: "down", KeyA: "left", ArrowLeft: "left",
  KeyD: "right", ArrowRight: "right", Space: "hand" };
const HEARTBEAT = 100;  // ms between two words of the pedals while they are pressed
const STRIP_SECONDS = 30;
const EDGE = { left: 34, right: 12 };  // px beside plots, where the numbers of their axes stand
const ROW = 58, PLOT = 36, HEAD = 34;  // px: of a plot with its name, of its axes, of what stands above the plots of a time line
const INKS = { speed: "#4d9dff", limit: "#ff8552", gap: "#4fce7f", ttc: "#ff7ab8", grip: "#f2b441", dim: "#9aa5b1", beside: "#c9d1d9",
  crash: "#ff5b52", "put back": "#f2b441", marking: "#b58cff", notice: "#9aa5b1", hazard: "#ff4fa3" };
const PLACES = ["left", "rear", "right", "top", "depth", "semantic", "radar"];  // of the small views, as a page begins
const LAYOUT = "skidpad-layout";  // what this browser keeps of it

function layout() {  // as it was left in this browser
  let kept = {};
  try { kept = JSON.parse(localStorage.getItem(LAYOUT)) || {}; } catch { /* nothing that can be read */ }
  const whole = Array.isArray(kept.places) && [...kept.places].sort().join() === [...PLACES].sort().join();
  return { places: whole ? kept.places : [...PLACES], side: /^\d\d%$/.test(kept.side) ? kept.side : "20%" };
}

export default {
  props: { tab: String, kind: String, tiers: Array, timeline: Object, help: Array },
  template: `
<div class="cockpit" :class="kind" :style="{ '--side': side }">
  <div class="bar"><span ref="bar" class="said">connecting ...</span><span ref="wrong" class="wrong"></span></div>
  <div class="mirrors">
    <figure v-for="v in places.slice(0, 3)" :key="v" :data-view="v" draggable="true" @click="choose(v)" @dragstart="dragged = v"
      @dragover.prevent @drop.prevent="swap(v)"><canvas :ref="v"></canvas><figcaption>{{ title(v) }}</figcaption></figure>
  </div>
  <div class="stage"><canvas ref="main"></canvas><div class="beside"><canvas ref="beside"></canvas><div class="hud"><div ref="other" class="mode"></div></div></div>
    <div class="hud">
      <div class="speed"><b ref="speed">-</b> km/h <span ref="gear" class="gear"></span></div>
      <div class="stop" title="a full braking on the grip that the tyres find now"><small>stop in</small> <b ref="stop">-</b> m
        <div class="gauge"><i ref="grip"></i></div><small ref="gripSaid"></small></div>
      <div ref="mode" class="mode"></div>
      <div class="pedals"><i ref="throttle" class="throttle"></i><i ref="brake" class="brake"></i>
        <span class="steer"><i ref="steer"></i></span></div>
    </div>
    <div class="touch" v-if="kind === 'drive'">
      <div v-for="t in touchpads" :key="t" :data-touch="t" @pointerdown.prevent="touch(t, $event)" @pointermove="touch(t, $event)"
        @pointerup="release(t)" @pointercancel="release(t)" @contextmenu.prevent><i ref="pads"></i><small>{{ t }}</small></div>
    </div>
    <div class="keys" v-if="helpShown" @click="helpShown = false"><h3>Keys</h3><dl><template v-for="[k, does] in help" :key="k"><dt>{{ k }}</dt><dd>{{ does }}</dd></template></dl></div>
    <div class="lamp" ref="lamp"></div>
    <div class="alert" ref="alert"></div>
    <div class="edge" title="drag: width of the small views" @pointerdown="$event.target.setPointerCapture($event.pointerId)"
      @pointermove="$event.buttons && pull($event)"></div>
  </div>
  <div class="side">
    <figure v-for="v in places.slice(3)" :key="v" :data-view="v" draggable="true" @click="choose(v)" @dragstart="dragged = v"
      @dragover.prevent @drop.prevent="swap(v)"><canvas :ref="v"></canvas><figcaption>{{ title(v) }}</figcaption></figure>
  </div>
  <div class="facts"><dl ref="facts"></dl>
    <ol ref="tiers" class="tiers"></ol>
    <div class="grip"><svg viewBox="0 0 60 84"><rect x="18" y="8" width="24" height="68" rx="7"/>
      <g v-for="(w, i) in wheels" :key="i"><rect :ref="'w' + i" :x="w[0]" :y="w[1]" width="11" height="20" rx="3"/>
      <text :ref="'m' + i" :x="w[0] + 5.5" :y="w[1] + 29"></text></g></svg><small>friction</small></div>
    <ul ref="events" class="events"></ul><dl ref="added" class="added"></dl></div>
  <div class="strips"><canvas ref="strip"></canvas></div>
  <div class="line" v-if="timeline"><canvas ref="line" @pointerdown="seek"
    @pointermove="$event.buttons && seek($event)"></canvas></div>
</div>`,
  data: () => ({ helpShown: false, touchpads: ["steer", "brake", "throttle"], wheels: [[4, 10], [45, 10], [4, 48], [45, 48]], ...layout() }),
  mounted() {
    this.keys = {}; this.touched = {}; this.history = []; this.pressed = false; this.shownAt = []; this.waiting = {};
    for (const name of this.tiers) this.$refs.tiers.append(Object.assign(document.createElement("li"), { textContent: name }));
    this.down = (e) => this.key(e, true); this.up = (e) => this.key(e, false);
    this.away = () => { this.keys = {}; Object.keys(this.touched).forEach((pad) => this.release(pad)); this.beat(); };
    document.addEventListener("keydown", this.down); document.addEventListener("keyup", this.up);
    window.addEventListener("blur", this.away); document.addEventListener("visibilitychange", this.away);
    this.beating = setInterval(() => this.beat(), HEARTBEAT);
    this.resized = new ResizeObserver(() => this.head && this.curves(this.head));  // also while the run stands
    this.resized.observe(this.$refs.strip);
    this.open();
  },
  unmounted() {
    this.gone = true; clearInterval(this.beating); this.resized.disconnect(); this.socket.close();
    document.removeEventListener("keydown", this.down); document.removeEventListener("keyup", this.up);
    window.removeEventListener("blur", this.away); document.removeEventListener("visibilitychange", this.away);
  },
  methods: {
    title(v) { return TITLES[v]; },
    canvas(name) { const c = this.$refs[name]; return Array.isArray(c) ? c[0] : c; },
    choose(v) { if (v !== "radar") this.say("main", v); },
    swap(v) {  // the view that is dragged and the one that it is dropped on change places
      const from = this.places.indexOf(this.dragged), to = this.places.indexOf(v); if (from < 0 || from === to) return;
      const places = [...this.places]; places[from] = v; places[to] = this.dragged; this.places = places; this.keep();
    },
    pull(e) {
      const box = this.$el.getBoundingClientRect(), share = (box.right - e.clientX) / box.width;
      this.side = `${Math.round(100 * Math.max(0.1, Math.min(0.6, share)))}%`; this.keep();
    },
    keep() { try { localStorage.setItem(LAYOUT, JSON.stringify({ places: this.places, side: this.side })); } catch { /* it may keep nothing */ } },
    open() {
      const scheme = location.protocol === "https:" ? "wss" : "ws";
      this.socket = new WebSocket(`${scheme}://${location.host}/stream?tab=${this.tab}`);
      this.socket.binaryType = "arraybuffer";
      this.socket.onopen = () => this.follow();
      this.socket.onmessage = (e) => typeof e.data === "string" ? this.told(JSON.parse(e.data)) : this.picture(e.data);
      this.socket.onclose = () => { if (this.gone || this.ended) return; this.$refs.bar.textContent = "the connection is lost, trying again ...";
        setTimeout(() => this.open(), 1000); };
    },
    follow() {  // a link to a moment of a replay: #t=12.35
      const at = /^#t=([\d.]+)$/.exec(location.hash);
      if (this.kind !== "replay" || !at || this.followed) return;
      this.followed = true; this.say("stand"); this.say("seek", Math.round(+at[1] / this.timeline.dt));
    },
    say(word, value = null) {
      if (this.socket.readyState === WebSocket.OPEN) this.socket.send(JSON.stringify({ word, value }));
    },
    told(message) {
      if (message.awake) this.socket.send(JSON.stringify({ awake: true }));
      if ("drives" in message) { this.drives = message.drives;
        this.$refs.bar.textContent = message.drives ? "this tab drives" : "another tab drives: this one watches";
        this.$el.classList.toggle("watches", !message.drives); }
      if (message.wrong) this.warn(message.wrong);
      if (message.ended) { this.ended = true; this.$refs.alert.textContent = message.ended; this.$el.classList.add("over"); }
    },
    async picture(data) {  // one after the other, or a late one would be shown over the newest; who slept sees the newest only
      this.newest = data;
      if (this.painting) return;
      this.painting = true;
      try { while (this.newest) { const one = this.newest; this.newest = null; await this.paint(one); } } finally { this.painting = false; }
    },
    async paint(data) {
      const length = new DataView(data).getUint32(0, true);
      const head = JSON.parse(new TextDecoder().decode(new Uint8Array(data, 4, length)));
      let at = 4 + length;
      const jobs = head.views.map(([name, size]) => {
        const blob = new Blob([new Uint8Array(data, at, size)], { type: "image/jpeg" }); at += size;
        return createImageBitmap(blob).then((bitmap) => this.draw(name === head.main ? "main" : name, bitmap));
      });
      const shown = new Set(head.views.map(([name]) => name));
      for (const name of SMALL) this.figure(name, shown.has(name) && name !== head.main);
      try { await Promise.all(jobs); } finally {
        if (this.socket.readyState === WebSocket.OPEN) this.socket.send(JSON.stringify({ ack: head.number }));
      }
      this.show(head);
    },
    figure(name, on) { const f = this.canvas(name).parentElement; f.style.display = on ? "" : "none"; },
    draw(name, bitmap) {
      const canvas = this.canvas(name);
      if (!canvas) return;
      if (canvas.width !== bitmap.width || canvas.height !== bitmap.height) { canvas.width = bitmap.width; canvas.height = bitmap.height; }
      canvas.getContext("2d").drawImage(bitmap, 0, 0); bitmap.close();
    },
    show(h) {
      const r = this.$refs, m = h.motion, s = h.stack, seat = h.seat; this.head = h; this.$el.dataset.paused = h.paused; this.$el.dataset.main = h.main; this.$el.dataset.extras = h.extras.join(" ");
      r.speed.textContent = Math.round(Math.abs(m.speed_kmh));
      r.gear.textContent = (m.reverse ? "R" : m.gear > 0 ? `D${m.gear}` : "N") + (seat.pressed_s > 0 ? `, brake held ${seat.pressed_s} s` : "");
      r.stop.textContent = m.stop_m === null ? "-" : m.stop_m < 1000 ? m.stop_m : "> 999";
      r.grip.style.width = `${100 * Math.min(m.grip || 0, 1)}%`; r.grip.style.background = this.ink(m.grip);
      r.gripSaid.textContent = m.grip === null ? "no grip" : `grip ${m.grip.toFixed(2)}`;
      if (seat.manual && !this.$el.classList.contains("manual") && matchMedia("(pointer: coarse)").matches)
        this.$el.scrollIntoView();  // on a phone the button lies far below the wheel and pedals
      r.mode.textContent = s.mode || ""; this.$el.classList.toggle("manual", !!seat.manual);
      r.throttle.style.height = `${100 * (m.throttle || 0)}%`; r.brake.style.height = `${100 * (m.brake || 0)}%`;
      r.steer.style.left = `${50 - 50 * (m.steer || 0)}%`;
      r.lamp.textContent = (seat.beam ? `lamps ${seat.beam}` : "") + (seat.lamps && seat.lamps !== "sun" ? ` (${seat.lamps})` : "") + (m.handbrake ? "  handbrake" : "");
      const last = h.events.length ? h.events[h.events.length - 1] : null;
      r.alert.textContent = this.ended ? r.alert.textContent : last && h.t - last[0] < 2 && h.t >= last[0] ? last[1] : h.paused ? "paused" : "";
      if (h.kind === "replay" && h.paused && location.hash !== `#t=${h.t}`) history.replaceState(null, "", `#t=${h.t}`);
      this.now = performance.now(); this.shownAt.push(this.now); this.shownAt = this.shownAt.filter((t) => this.now - t < 1000);
      const unit = (v, u) => v === null || v === undefined ? "-" : `${v} ${u}`;
      this.list([["time", `${h.t.toFixed(2)} s`], ["status", s.status || "-"], ["distance", unit(s.distance, "m")],
        ["time gap", unit(s.time_gap, "s")], ["bumper, roof", `${unit(s.bumper, "")} ${unit(s.roof, "m")}`],
        ["radar", unit(s.radar, "m")], ["radar limit", unit(s.radar_limit, "m/s")],
        ["light", s.light ? `${s.light} at ${s.light_at} m` : "-"], ["weather", seat.weather],
        ["grip", seat.grip || ""], ["collisions", h.collisions], ["real time", h.rtf ? `${h.rtf.toFixed(2)} x` : h.kind === "replay" ? `${h.rate} x` : "-"],
        ["pictures", `${this.shownAt.length}/s, ${h.dropped} dropped`], ["drives", seat.manual ? `you, by ${seat.method}` : "the stack"],
        ["on", seat.functions ? seat.functions.join(" ") || "nothing" : "-"]], r.facts);
      this.list(h.added || [], r.added);
      [...r.tiers.children].forEach((li, i) => li.classList.toggle("lit", i === s.tier));
      m.mu.forEach((v, i) => { const w = r[`w${i}`][0], t = r[`m${i}`][0]; t.textContent = v === null ? "" : v.toFixed(2);
        w.style.fill = this.ink(v); });
      r.events.replaceChildren(...h.events.slice(-5).reverse().map(([t, text]) =>
        Object.assign(document.createElement("li"), { textContent: `${t.toFixed(1)} s  ${text}` })));
      if (h.note && h.note !== this.note) { this.note = h.note; r.bar.textContent = h.note; }
      this.$el.classList.toggle("pair", !!h.beside);
      if (h.beside) r.other.textContent = `${Math.round(Math.abs(h.beside.speed_kmh))} km/h  ${h.beside.mode}  ${h.beside.weather}  ${h.beside.collisions} collisions`;
      this.radar(h.radar); this.curves(h);
    },
    curves(h) { this.strip(h); if (this.timeline) this.line(h); },
    ink(mu) { return mu === null ? "#555" : `hsl(${Math.max(0, Math.min(1, (mu - 0.1) / 0.8)) * 130}, 70%, 48%)`; },  // red: slippery
    list(rows, dl) {
      if (dl.children.length !== 2 * rows.length) dl.replaceChildren(...rows.flatMap(() => [document.createElement("dt"), document.createElement("dd")]));
      rows.forEach(([k, v], i) => { dl.children[2 * i].textContent = k; dl.children[2 * i + 1].textContent = v; });
    },
    radar(points) {
      const c = this.canvas("radar"); if (c.width !== 240) { c.width = 240; c.height = 180; }
      const g = c.getContext("2d"), k = c.height / 85; g.fillStyle = "#10141a"; g.fillRect(0, 0, c.width, c.height);
      g.strokeStyle = "#303944"; g.fillStyle = "#6b7682"; g.font = "10px sans-serif";
      for (const d of [20, 40, 60, 80]) { g.beginPath(); g.arc(c.width / 2, c.height - 6, d * k, 1.17 * Math.PI, 1.83 * Math.PI); g.stroke(); g.fillText(d, c.width / 2 + 3, c.height - 8 - d * k); }
      for (const [x, y, v] of points) { g.fillStyle = v < -1 ? "#ff8552" : "#e8eaed"; g.fillRect(c.width / 2 - y * k - 1.5, c.height - 6 - x * k - 1.5, 3, 3); }
    },
    strip(h) {
      const H = this.history; if (H.length && (h.t < H[H.length - 1][0] || h.t - H[H.length - 1][0] > 5)) H.length = 0;
      const envelope = (name) => ((h.added || []).find(([k]) => k.startsWith("Speed envelope") && k.endsWith(`, ${name}`)) || [])[1];
      const limit = envelope("speed mps") === undefined ? null : 3.6 * envelope("speed mps"), by = envelope("binding");
      H.push([h.t, h.motion.speed_kmh, h.stack.distance, limit, h.motion.grip]); while (H.length && h.t - H[0][0] > STRIP_SECONDS) H.shift();
      const [g, w] = this.fit(this.$refs.strip), end = w - EDGE.right, wide = end - EDGE.left;
      const points = (i) => H.map((one) => [end - (h.t - one[0]) / STRIP_SECONDS * wide, one[i]]);
      const note = limit === null ? "" : `envelope ${Math.round(limit)}${by && by !== "none" ? `, ${by}` : ""}`;
      this.plots(g, w, 0, [["speed, km/h", INKS.speed, this.round(H.flatMap((one) => [one[1], one[3]]), 20), points(1), h.motion.speed_kmh, points(3), note],
        ["distance reported, m", INKS.gap, 80, points(2), h.stack.distance],
        ["grip of the tyres", INKS.grip, this.round([1, ...H.map((one) => one[4])], 0.1), points(4), h.motion.grip]]);
      this.times(g, w, 3 * ROW + 12, -STRIP_SECONDS, 0);
    },
    round(values, step) { return +(Math.max(1, Math.ceil(Math.max(...values) / step - 1e-9)) * step).toFixed(1); },  // up: the upper end of an axis
    plots(g, w, top, rows) {  // one below the other: name, value now, numbers at the ends of the axis, curve
      rows.forEach(([name, ink, most, points, now, limit, note, none, other, then], i) => {
        const low = top + (i + 1) * ROW - 4, high = low - PLOT, end = w - EDGE.right, y = (v) => low - PLOT * Math.max(0, Math.min(v / most, 1));
        g.strokeStyle = "#303944"; g.strokeRect(EDGE.left - 0.5, high - 0.5, end - EDGE.left + 1, PLOT + 1);
        g.textAlign = "right"; g.fillStyle = INKS.dim; g.fillText(most, EDGE.left - 5, high + 8); g.fillText("0", EDGE.left - 5, low);
        g.fillStyle = ink; g.fillText(now ?? "-", end, high - 5); g.textAlign = "left"; g.fillText(name, EDGE.left, high - 5);
        if (other) { g.fillStyle = INKS.beside; g.textAlign = "right"; g.fillText(`beside ${then ?? "-"}`, end - 40, high - 5); g.textAlign = "left"; }
        if (note) { g.fillStyle = INKS.limit; g.fillText(note, EDGE.left + g.measureText(name).width + 12, high - 5); }
        if ([...points, ...(other || [])].every((one) => one[1] === null)) { g.fillStyle = INKS.dim; g.textAlign = "center"; g.fillText(none || "no value", (EDGE.left + end) / 2, (low + high) / 2 + 4); g.textAlign = "left"; }
        if (limit) this.curve(g, limit, y, INKS.limit, 1.2);
        if (other) { g.setLineDash([5, 3]); this.curve(g, other, y, INKS.beside, 1.4); g.setLineDash([]); }
        this.curve(g, points, y, ink, 1.8);
      });
    },
    curve(g, points, y, ink, thick) {  // gaps where there is no value, a dot for a lone one
      g.strokeStyle = g.fillStyle = ink; g.lineWidth = thick; g.beginPath(); let pen = false;
      points.forEach(([x, v], i) => { if (v === null) { pen = false; return; }
        if (pen) g.lineTo(x, y(v)); else { g.moveTo(x, y(v)); if ((points[i + 1] || [])[1] == null) g.fillRect(x - 1, y(v) - 1, 2, 2); } pen = true; });
      g.stroke(); g.lineWidth = 1;
    },
    times(g, w, y, first, last) {  // s at both ends and at round numbers between
      const wide = w - EDGE.left - EDGE.right, per = wide / Math.max(last - first, 1e-9), apart = 56, write = (text, x, to) => { g.textAlign = to; g.fillText(text, x, y); };
      const step = [1, 2, 5, 10, 20, 30, 60, 120, 300, 600, 1200].find((s) => s * per >= apart) || 3600;
      g.fillStyle = INKS.dim; write(+first.toFixed(1), EDGE.left, "left"); write(`${+last.toFixed(1)} s`, w - EDGE.right, "right");
      for (let t = Math.ceil(first / step) * step; t < last; t += step) if (Math.min(t - first, last - t) * per >= apart) write(t, EDGE.left + (t - first) * per, "center");
      g.textAlign = "left";
    },
    fit(c) {  // as many pixels as the screen has for it; drawn in pixels of the page
      const k = window.devicePixelRatio || 1, w = c.clientWidth, high = c.clientHeight;
      if (c.width !== Math.round(w * k) || c.height !== Math.round(high * k)) { c.width = Math.round(w * k); c.height = Math.round(high * k); }
      const g = c.getContext("2d"); g.setTransform(k, 0, 0, k, 0, 0); g.clearRect(0, 0, w, high); g.font = "11px sans-serif"; return [g, w, high];
    },
    line(h) {
      const [g, w] = this.fit(this.$refs.line), T = this.timeline, n = Math.max(T.last - T.first, 1), wide = w - EDGE.left - EDGE.right;
      const x = (tick) => EDGE.left + Math.min((tick - T.first) / n, 1) * wide, at = (i) => x(T.first + i * T.stride), i = Math.floor((h.tick - T.first) / T.stride);
      const bar = (from, to, y, high, ink) => { const long = Math.max(to - from, 3); g.fillStyle = ink; g.fillRect(Math.min(from, w - EDGE.right - long), y, long, high); };
      T.tier.forEach((v, k) => { if (v !== null) bar(at(k), at(k + 1) + 0.5, 20, 7, `hsl(${v * 27}, 60%, 50%)`); });
      const rule = (at, ink) => { g.fillStyle = ink; for (let k = 1; k <= 4; k++) g.fillRect(at - 1, HEAD + k * ROW - 4 - PLOT, 2, PLOT); };  // beside no name
      const worst = Math.max(...T.violated, 1);
      T.violated.forEach((v, k) => { if (v) bar(at(k), at(k + 1) + 0.5, 20, 7, `rgba(255, 79, 163, ${0.25 + 0.75 * v / worst})`); });
      for (const [first, last] of T.hazards) bar(x(first), x(last), 14, 5, INKS.hazard);
      g.fillStyle = INKS.dim; g.fillText(T.violated.length ? `indicators beyond bounds, up to ${Math.max(...T.violated)}` : "acting tier", EDGE.left, 10);
      g.textAlign = "right"; let right = w - EDGE.right;  // what the colours of the marks mean
      for (const kind of new Set([...T.events.map((one) => one[1]), ...(T.hazards.length ? ["hazard"] : [])])) { g.fillStyle = INKS[kind]; g.fillText(kind, right, 10); right -= g.measureText(kind).width + 10; }
      g.textAlign = "left"; const low = HEAD + 4 * ROW - 4;
      for (const [tick, kind] of T.events) { bar(x(tick) - 1.5, x(tick) + 1.5, 16, 15, INKS[kind]); if (kind === "crash") rule(x(tick), INKS[kind]); }
      const points = (values) => values.map((v, k) => [at(k), v]), B = h.beside ? h.beside.curves : null, j = B ? Math.floor((h.tick - T.first) / B.stride) : 0;
      const beside = (name) => B ? [B[name].slice(0, Math.floor(n / B.stride) + 1).map((v, k) => [x(T.first + k * B.stride), v]), B[name][j]] : [], most = (name) => [...T[name], ...(B ? B[name] : [])];
      this.plots(g, w, HEAD, [["speed, km/h", INKS.speed, this.round([...most("speed"), ...T.limit], 20), points(T.speed), T.speed[i], points(T.limit), T.limit.length ? "speed envelope" : "", "", ...beside("speed")],
        ["gap to what is ahead, m", INKS.gap, T.far, points(T.gap), T.gap[i], null, "", `nothing within ${T.far} m`, ...beside("gap")], ["time to collision, s", INKS.ttc, T.near, points(T.ttc), T.ttc[i], null, "", `none below ${T.near} s`, ...beside("ttc")],
        ["grip of the tyres", INKS.grip, this.round([1, ...most("grip")], 0.1), points(T.grip), T.grip[i], null, "", "not recorded", ...beside("grip")]]);
      this.times(g, w, low + 16, T.first * T.dt, T.last * T.dt);
      rule(x(h.tick), "#fff"); g.fillRect(x(h.tick) - 1, 14, 2, 15);
    },
    seek(e) {
      const box = e.target.getBoundingClientRect(), T = this.timeline, share = (e.clientX - box.left - EDGE.left) / (box.width - EDGE.left - EDGE.right);
      this.say("seek", Math.round(T.first + Math.max(0, Math.min(share, 1)) * (T.last - T.first)));
    },
    key(e, down) {
      const focus = document.activeElement, tag = focus ? focus.tagName : "";
      if (e.ctrlKey || e.metaKey || e.altKey || (tag === "INPUT" && focus.type !== "checkbox") || tag === "TEXTAREA") return;
      if (e.code in PEDALS && this.kind === "drive") { e.preventDefault(); if (!!this.keys[PEDALS[e.code]] !== down) { this.keys[PEDALS[e.code]] = down; this.beat(true); } return; }
      if (!down) return;
      if (e.key === "?" || (e.key === "Escape" && this.helpShown)) { this.helpShown = !this.helpShown; return; }
      if (this.kind === "replay") {
        if (e.code === "Space") { e.preventDefault(); return this.say("pause"); }
        if (e.code === "ArrowLeft" || e.code === "ArrowRight") { e.preventDefault();
          const by = (e.shiftKey ? 100 : this.timeline.step) * (e.code === "ArrowLeft" ? -1 : 1); return this.say("seek", (this.head ? this.head.tick : 0) + by); }
      }
      if (e.code in WORDS && !e.repeat) this.say(...WORDS[e.code]);
    },
    beat(now = false) {
      if (this.kind !== "drive" || !this.socket) return;
      const pedals = this.gamepad() || this.touchPedals() || this.keyboard(), pressed = pedals.throttle > 0 || pedals.brake > 0 || Math.abs(pedals.steer) > 0 || pedals.handbrake;
      if (pressed || this.pressed || now) this.say("pedals", pedals);
      this.pressed = pressed;
    },
    warn(text) {
      this.$el.dataset.wrong = text; this.$refs.wrong.textContent = text;
      setTimeout(() => { this.$refs.wrong.textContent = ""; }, 4000);
    },
    keyboard() {
      const k = this.keys, n = (v) => v ? 1 : 0;
      return { throttle: n(k.up), brake: n(k.down), steer: n(k.left) - n(k.right), handbrake: !!k.hand, method: "keyboard" };
    },
    touch(name, e) {  // from the middle of the wheel to the left is 1; the higher on a pedal, the more
      if (e.type === "pointerdown") e.target.setPointerCapture(e.pointerId);
      else if (!(name in this.touched)) return;
      const box = e.currentTarget.getBoundingClientRect(), clip = (v, low) => Math.round(100 * Math.max(low, Math.min(1, v))) / 100;
      this.touched[name] = name === "steer" ? clip(1 - 2 * (e.clientX - box.left) / box.width, -1) : clip((box.bottom - e.clientY) / box.height, 0);
      this.drawPad(name); if (e.type === "pointerdown") this.beat(true);
    },
    release(name) { delete this.touched[name]; this.drawPad(name); this.beat(true); },
    drawPad(name) {  // the wheel turns and a pedal fills as they are touched
      const v = this.touched[name] || 0, mark = this.$refs.pads[this.touchpads.indexOf(name)];
      if (name === "steer") mark.style.transform = `rotate(${-90 * v}deg)`; else mark.style.height = `${100 * v}%`;
    },
    touchPedals() {
      const t = this.touched; if (Object.keys(t).length) this.wasTouched = true; else if (!this.wasTouched) return null;
      if (!Object.keys(t).length) this.wasTouched = false;
      return { throttle: t.throttle || 0, brake: t.brake || 0, steer: t.steer || 0, handbrake: false, method: "touch" };
    },
    trodden(pad, i) {  // 1 is released; a browser says exactly 0, half the way, until a pedal is first moved
      this.moved = this.moved || {}; const v = pad.axes[i] ?? 1, name = `${pad.id} ${i}`;
      if (v !== 0) this.moved[name] = true;
      return this.moved[name] ? Math.max(0, (1 - v) / 2) : 0;
    },
    gamepad() {
      const pad = navigator.getGamepads ? [...navigator.getGamepads()].find((p) => p && p.connected) : null;
      if (!pad) {
        if (this.plugged) this.warn(`the ${this.plugged} is unplugged: pedals are released, the keyboard drives`);
        this.plugged = ""; return null;
      }
      const b = (i) => pad.buttons[i] ? pad.buttons[i].value : 0, dead = (v) => Math.abs(v) < 0.06 ? 0 : v, r = (v) => Math.round(v * 100) / 100;
      const wheel = /wheel|g29|g920|t150|t300/i.test(pad.id);
      const p = wheel
        ? { throttle: r(this.trodden(pad, 2)), brake: r(this.trodden(pad, pad.axes.length > 5 ? 5 : 3)) }
        : { throttle: r(b(7)), brake: r(b(6)) };
      Object.assign(p, { steer: r(-dead(pad.axes[0] || 0)), handbrake: b(0) > 0.5, method: wheel ? "wheel" : "gamepad" });
      const used = p.throttle > 0.02 || p.brake > 0.02 || p.steer !== 0 || p.handbrake;
      if (used) this.padded = performance.now();
      if (this.padded) this.plugged = p.method;
      return used || performance.now() - (this.padded || -1e9) < 1000 ? p : null;
    },
  },
};
