/* global REPORT, draw, dark */
"use strict";
// A clip's telemetry beside a sibling's: unpacking, plotting, and one time that films, cursor and slider share.

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
async function unpack({ rows, columns, packed, boxes }) {
  const squeezed = Uint8Array.from(atob(packed), (c) => c.charCodeAt(0));
  const stream = new Blob([squeezed]).stream().pipeThrough(new DecompressionStream("deflate"));
  const planes = new Uint8Array(await new Response(stream).arrayBuffer());
  const read = new Map(columns.map((name, k) => {
    const bytes = new Uint8Array(8 * rows);
    for (let b = 0; b < 8; b++) {
      const start = (8 * k + b) * rows;
      for (let i = 0; i < rows; i++) bytes[8 * i + b] = planes[start + i];
    }
    return [name, new Float64Array(bytes.buffer)];
  }));
  return Object.assign(read, { boxes });
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

/** The traces under the films; `onScrub` gets the time to which someone drags. */
class Traces {
  constructor(box, onScrub) {
    this.box = box;
    this.plot = box.querySelector("#plot");
    this.cursor = box.querySelector("#cursor");
    this.onScrub = onScrub;
    this.shown = [];
    this.time = 0;
    this.heads = REPORT.panels.map((panel) => {
      const head = document.createElement("div");
      head.className = "panel-head";
      head.append(`${panel.caption}${panel.unit ? ` [${panel.unit}]` : ""}`,
        ...["a", "b"].map((side) => Object.assign(document.createElement("output"), { className: side })));
      box.append(head);
      return head;
    });
    box.addEventListener("pointerdown", (event) => this.grab(event), { capture: true });
    dark.addEventListener("change", () => this.draw());
  }

  /** Show one or two clips' telemetry, [{label, columns}]. */
  show(shown) {
    this.shown = shown;
    this.box.hidden = shown.length === 0;
    this.draw();
  }

  draw() {
    if (this.shown.length === 0) return;
    // the sibling first, so that the clip itself lies on top
    const data = this.shown.flatMap(({ columns }, side) => {
      const x = columns.get("t_ns").map((t) => t / 1e9);
      return REPORT.panels.map(({ column, factor }, k) => ({
        type: "scatter", mode: "lines", xaxis: axis("x", k), yaxis: axis("y", k), x, y: columns.get(column).map((v) => v * factor),
        line: { color: ["--a", "--b"][side], width: 1.4 },
      }));
    }).reverse();
    this.plot.drawn = { ...REPORT.figure, data };
    this.plot.own = { hovermode: false, dragmode: this.plot.layout?.dragmode ?? false };
    this.plot.config = { displayModeBar: "hover", modeBarButtons: [["zoom2d", "pan2d", "resetScale2d", "toImage"]], doubleClick: "reset" };
    draw(this.plot);
    if (!this.listening) this.plot.on("plotly_afterplot", () => this.point(this.time));
    this.listening = true;
    this.point(this.time);
  }

  /** Put the cursor and the read-outs at a time [s]. */
  point(time) {
    this.time = time;
    const full = this.plot._fullLayout;
    if (!full?.xaxis || this.shown.length === 0) return;
    const [from, to] = full.xaxis.range;
    const bottom = full[axisKey(this.heads.length - 1)];
    this.cursor.hidden = time < from || time > to;
    this.cursor.style.left = `${full.xaxis._offset + full.xaxis.l2p(time)}px`;
    this.cursor.style.top = `${full.yaxis._offset}px`;
    this.cursor.style.height = `${bottom._offset + bottom._length - full.yaxis._offset}px`;
    this.heads.forEach((head, k) => {
      const panel = REPORT.panels[k];
      head.style.top = `${full[axisKey(k)]._offset - 20}px`;
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

const axis = (letter, k) => `${letter}${k === 0 ? "" : k + 1}`;
const axisKey = (k) => axis("yaxis", k);

/** One clock for two films, or for none; `onTime` gets the moment on show. */
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
