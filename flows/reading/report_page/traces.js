/* global Plotly, REPORT */
"use strict";
// A clip's telemetry beside a sibling's: unpacking, plotting, and one time that films, cursor and slider share.

const PANEL_PX = 108;
const HEAD_PX = 22;
const MARGIN = { l: 46, r: 10, t: 14, b: 38 };

const waiting = new Map();

/** Called by each file in clips/. */
function clipArrived(id, content) {
  waiting.get(id)(content);
}

/** Telemetry of a clip: Map of column name to Float64Array, read once from its script (fetch fails on file://). */
const telemetryOf = (() => {
  const known = new Map();
  return (clip) => {
    if (!known.has(clip.clip_id)) {
      known.set(clip.clip_id, new Promise((resolve, reject) => {
        waiting.set(clip.clip_id, resolve);
        const script = document.createElement("script");
        script.src = `clips/${encodeURIComponent(clip.clip_id)}.js`;
        script.onerror = () => reject(new Error(`clips/${clip.clip_id}.js is missing: make the report again`));
        document.head.append(script);
      }).then(unpack));
    }
    return known.get(clip.clip_id);
  };
})();

/** Undo deflate and the byte planes: a column is eight planes of one byte of every number, lowest first. */
async function unpack({ rows, columns, packed }) {
  const squeezed = Uint8Array.from(atob(packed), (c) => c.charCodeAt(0));
  const stream = new Blob([squeezed]).stream().pipeThrough(new DecompressionStream("deflate"));
  const planes = new Uint8Array(await new Response(stream).arrayBuffer());
  return new Map(columns.map((name, k) => {
    const bytes = new Uint8Array(8 * rows);
    for (let b = 0; b < 8; b++) {
      const start = (8 * k + b) * rows;
      for (let i = 0; i < rows; i++) bytes[8 * i + b] = planes[start + i];
    }
    return [name, new Float64Array(bytes.buffer)];
  }));
}

/** A row a tick, as in the view ticks; numbers in the shortest form that reads back to the same double. */
function asCsv(clip, columns) {
  const quoted = (text) => {
    // a spreadsheet would take such a label for a formula
    const inert = /^[=+\-@\t\r]/.test(text) ? `'${text}` : text;
    return /[",\r\n]/.test(inert) ? `"${inert.replaceAll('"', '""')}"` : inert;
  };
  const names = [...columns.keys()];
  const values = [...columns.values()];
  const identity = [clip.clip_id, clip.label, clip.scenario.weather].map(quoted).join(",");
  const lines = [["clip_id", "label", "weather", ...names].join(",")];
  for (let i = 0; i < values[0].length; i++) lines.push(`${identity},${values.map((v) => v[i]).join(",")}`);
  return lines.join("\n") + "\n";
}

/** The traces under the films; `onScrub` is told the time to which someone drags. */
class Traces {
  constructor(box, onScrub) {
    this.box = box;
    this.plot = box.querySelector("#plot");
    this.cursor = box.querySelector("#cursor");
    this.onScrub = onScrub;
    this.shown = [];
    this.time = 0;
    this.heads = REPORT.panels.map((panel, k) => {
      const head = document.createElement("div");
      head.className = "panel-head";
      head.style.top = `${MARGIN.t + k * PANEL_PX}px`;
      head.append(`${panel.caption}${panel.unit ? ` [${panel.unit}]` : ""}`,
        ...["a", "b"].map((side) => Object.assign(document.createElement("output"), { className: side })));
      box.append(head);
      return head;
    });
    box.addEventListener("pointerdown", (event) => this.grab(event), { capture: true });
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => this.draw());
  }

  /** Show one or two clips' telemetry, [{label, columns}]. */
  async show(shown) {
    this.shown = shown;
    this.box.hidden = shown.length === 0;
    await this.draw();
  }

  async draw() {
    if (this.shown.length === 0) return;
    const style = getComputedStyle(document.documentElement);
    const [ink, soft, line, ...colours] = ["--ink", "--soft", "--line", "--a", "--b"].map((n) => style.getPropertyValue(n).trim());
    const height = PANEL_PX * REPORT.panels.length;
    const layout = {
      height: height + MARGIN.t + MARGIN.b, margin: MARGIN, showlegend: false, dragmode: this.plot.layout?.dragmode ?? false,
      paper_bgcolor: "rgba(0,0,0,0)", plot_bgcolor: "rgba(0,0,0,0)", hovermode: false,
      font: { family: "system-ui, sans-serif", size: 11, color: soft },
      modebar: { bgcolor: "rgba(0,0,0,0)", color: soft, activecolor: ink, orientation: "h" },
      xaxis: { title: { text: "time [s]", standoff: 6 }, gridcolor: line, zeroline: false, anchor: axis(REPORT.panels.length - 1),
        range: this.plot.layout?.xaxis?.range ?? [0, REPORT.duration_s] },
    };
    const lines = [];
    REPORT.panels.forEach((panel, k) => {
      const from = k * PANEL_PX + HEAD_PX;
      layout[`yaxis${k === 0 ? "" : k + 1}`] = {
        domain: [1 - ((k + 1) * PANEL_PX - 6) / height, 1 - from / height], anchor: "x", fixedrange: true, nticks: 4,
        gridcolor: line, zeroline: true, zerolinecolor: line, rangemode: "normal",
      };
      this.shown.forEach(({ label, columns }, side) => lines.push({
        type: "scatter", mode: "lines", name: label, xaxis: "x", yaxis: axis(k),
        x: columns.get("t_ns").map((t) => t / 1e9), y: columns.get(panel.column).map((v) => v * panel.factor),
        line: { color: colours[side], width: 1.4 },
      }));
    });
    // the sibling first, so that the clip itself lies on top
    lines.reverse();
    await Plotly.react(this.plot, lines, layout, {
      responsive: true, displaylogo: false, doubleClick: "reset",
      modeBarButtons: [["zoom2d", "pan2d", "resetScale2d", "toImage"]],
    });
    if (!this.listening) {
      this.plot.on("plotly_relayout", () => this.point(this.time));
      this.plot.on("plotly_afterplot", () => this.point(this.time));
      this.listening = true;
    }
    this.point(this.time);
  }

  /** Put the cursor and the read-outs at a time [s]. */
  point(time) {
    this.time = time;
    const axis = this.plot._fullLayout?.xaxis;
    if (!axis || this.shown.length === 0) return;
    const [from, to] = axis.range;
    this.cursor.hidden = time < from || time > to;
    this.cursor.style.left = `${axis._offset + axis.l2p(time)}px`;
    this.cursor.style.top = `${MARGIN.t}px`;
    this.cursor.style.height = `${PANEL_PX * REPORT.panels.length}px`;
    this.heads.forEach((head, k) => {
      const panel = REPORT.panels[k];
      head.querySelectorAll("output").forEach((output, side) => {
        const values = this.shown[side]?.columns.get(panel.column);
        output.hidden = !values;
        if (!values) return;
        const tick = Math.min(Math.round(time * REPORT.tick_rate_hz), values.length - 1);
        output.textContent = (values[tick] * panel.factor).toFixed(panel.decimals).replace(/^-(0\.?0*)$/, "$1");
      });
    });
  }

  grab(event) {
    const plot = this.plot._fullLayout;
    if (!plot || event.button > 0 || event.target.closest(".modebar")) return;
    // zooming and panning, once chosen in the bar, keep the plot; the cursor can be dragged all the same
    const onCursor = event.target.closest("#cursor");
    if (!onCursor && plot.dragmode !== false) return;
    const left = this.plot.getBoundingClientRect().left + plot.xaxis._offset;
    const at = (e) => plot.xaxis.p2l(Math.min(Math.max(e.clientX - left, 0), plot.xaxis._length));
    const inside = event.clientX >= left - 8 && event.clientX <= left + plot.xaxis._length + 8;
    if (!inside) return;
    const move = (e) => this.onScrub(at(e));
    const end = () => {
      removeEventListener("pointermove", move);
      removeEventListener("pointerup", end);
      removeEventListener("pointercancel", end);
    };
    addEventListener("pointermove", move);
    addEventListener("pointerup", end);
    addEventListener("pointercancel", end);
    event.preventDefault();
    move(event);
  }
}

const axis = (k) => `y${k === 0 ? "" : k + 1}`;

/** One clock for two films, or for none; `onTime` is told what moment is on show. */
class Player {
  constructor(films, onTime) {
    this.films = films;
    this.onTime = onTime;
    this.time = 0;
    this.running = false;
    const lead = films[0];
    const follow = (_, { mediaTime }) => {
      if (this.running) this.moved(mediaTime);
      lead.requestVideoFrameCallback(follow);
    };
    lead.requestVideoFrameCallback(follow);
    lead.addEventListener("ended", () => this.pause());
  }

  /** Paths of the films, none for telemetry alone; the time stays. */
  load(paths) {
    this.pause();
    this.loaded = this.films.slice(0, paths.length);
    paths.forEach((path, k) => {
      if (this.films[k].getAttribute("src") !== path) this.films[k].src = path;
    });
    this.seek(this.time);
  }

  seek(time) {
    this.time = Math.min(Math.max(time, 0), REPORT.duration_s);
    // a little inside the frame nearest to that time, so that rounding does not show its neighbour
    const at = (Math.round(this.time * REPORT.frame_rate_hz) + 0.25) / REPORT.frame_rate_hz;
    for (const film of this.loaded) film.currentTime = at;
    this.onTime(this.time);
  }

  moved(time) {
    this.time = Math.min(time, REPORT.duration_s);
    for (const film of this.loaded.slice(1)) {
      if (Math.abs(film.currentTime - this.loaded[0].currentTime) > 1 / REPORT.frame_rate_hz) {
        film.currentTime = this.loaded[0].currentTime;
      }
    }
    this.onTime(this.time);
  }

  async play() {
    if (this.time >= REPORT.duration_s - 1e-6) this.seek(0);
    this.running = true;
    this.onTime(this.time);
    if (this.loaded.length > 0) {
      await Promise.all(this.loaded.map((film) => film.play().catch(() => this.pause())));
      return;
    }
    const started = performance.now() - 1000 * this.time;
    const tick = (now) => {
      if (!this.running) return;
      this.moved(Math.max((now - started) / 1000, 0));
      if (this.time >= REPORT.duration_s) this.pause();
      else requestAnimationFrame(tick);
    };
    requestAnimationFrame(tick);
  }

  pause() {
    this.running = false;
    for (const film of this.films) film.pause();
    this.onTime(this.time);
  }
}
