/* global Plotly */
"use strict";
// The figures of a verdict: drawn in the page's colours, zoomed by pointer, buttons and keys.

const FIGURES = JSON.parse(document.getElementById("figures").textContent);
const PANEL_PX = 150;
const PRESSURE_PX = 84;
const HEAD_PX = 20;
const MARGIN = { l: 52, r: 12, t: 4, b: 40 };
const DASHES = { frozen: "dot", after: "solid" };
const NAMES = { frozen: "frozen", after: "after" };
const KEYS = { "+": "in", "=": "in", "-": "out", "_": "out", ArrowLeft: "left", ArrowRight: "right", 0: "whole", Home: "whole" };
const CONFIG = { responsive: true, displaylogo: false, displayModeBar: false, doubleClick: "reset", scrollZoom: false };
const touched = matchMedia("(pointer: coarse)");
const dark = matchMedia("(prefers-color-scheme: dark)");

const axis = (letter, k) => `${letter}${k === 0 ? "" : k + 1}`;
const words = (name) => name.replaceAll("_", " ");

function colours() {
  const style = getComputedStyle(document.documentElement);
  const of = (name) => style.getPropertyValue(name).trim();
  return {
    ink: of("--ink"), soft: of("--soft"), line: of("--line"), card: of("--card"),
    frozen: of("--none"), after: of("--a"), measured: of("--ink"),
  };
}

function baseLayout(c, height, title, range) {
  return {
    height: height + MARGIN.t + MARGIN.b, margin: MARGIN, showlegend: false,
    // a finger scrolls the page; it zooms by the buttons
    dragmode: touched.matches ? false : "zoom",
    paper_bgcolor: "rgba(0,0,0,0)", plot_bgcolor: "rgba(0,0,0,0)",
    hovermode: "x unified", hoversubplots: "single", hoverlabel: { bgcolor: c.card, bordercolor: c.line, font: { color: c.ink } },
    font: { family: "system-ui, sans-serif", size: 11, color: c.soft },
    xaxis: { title: { text: title, standoff: 6 }, gridcolor: c.line, zeroline: false, range: [...range], hoverformat: ".2f" },
  };
}

const yAxis = (c, from, to, height) => ({
  domain: [Math.max(1 - to / height, 0), 1 - from / height], anchor: "x", fixedrange: true, nticks: 5,
  gridcolor: c.line, zeroline: true, zerolinecolor: c.soft, zerolinewidth: 1,
});

function drawRun(plot, run, shown) {
  const c = colours();
  const height = PANEL_PX * run.channels.length + PRESSURE_PX;
  const whole = [0, run.time_s.at(-1)];
  const layout = baseLayout(c, height, "time [s]", plot.layout?.xaxis?.range ?? whole);
  layout.xaxis.anchor = axis("y", run.channels.length);
  const lines = [];
  const heads = [];
  run.channels.forEach((channel, k) => {
    layout[`yaxis${k === 0 ? "" : k + 1}`] = yAxis(c, k * PANEL_PX + HEAD_PX, (k + 1) * PANEL_PX - 8, height);
    heads.push([`${words(channel.name)} [${channel.unit}]`, k * PANEL_PX]);
    for (const model of shown.filter((name) => run.models.includes(name))) {
      lines.push({
        type: "scatter", mode: "lines", name: NAMES[model], xaxis: "x", yaxis: axis("y", k),
        x: run.time_s, y: channel[model], hovertemplate: "%{y:.3g}",
        line: { color: c[model], width: model === "after" ? 1.8 : 1.4, dash: DASHES[model] },
      });
    }
  });
  const last = run.channels.length;
  layout[`yaxis${last === 0 ? "" : last + 1}`] = { ...yAxis(c, last * PANEL_PX + HEAD_PX, height, height), nticks: 3, rangemode: "tozero" };
  heads.push(["brake pressure [MPa]", last * PANEL_PX]);
  lines.push({
    type: "scatter", mode: "lines", name: "brake pressure", xaxis: "x", yaxis: axis("y", last),
    x: run.time_s, y: run.pressure_mpa, hovertemplate: "%{y:.3g} MPa", line: { color: c.soft, width: 1.2 },
  });
  show(plot, lines, layout, whole, heads);
}

/** Lines over one axis: each has a name, points, a colour's name and, if it has a band, its lower and upper edge. */
function drawLines(plot, lines, height, title, head) {
  const c = colours();
  const points = lines.flatMap((line) => line.x);
  const width = Math.max(...points) - Math.min(...points) || 1;
  const whole = [Math.min(...points) - 0.02 * width, Math.max(...points) + 0.03 * width];
  const layout = baseLayout(c, height, title, plot.layout?.xaxis?.range ?? whole);
  layout.yaxis = { ...yAxis(c, HEAD_PX, height, height), nticks: 7 };
  const drawn = lines.flatMap((line) => {
    const edge = { type: "scatter", mode: "lines", x: line.x, line: { width: 0 }, hoverinfo: "skip", name: "" };
    const band = line.low ? [
      { ...edge, y: line.low },
      { ...edge, y: line.high, fill: "tonexty", fillcolor: `${c[line.colour] === c.ink ? c.soft : c[line.colour]}38` },
    ] : [];
    return [...band, {
      type: "scatter", mode: line.x.length > 40 ? "lines" : "lines+markers", name: line.name, x: line.x, y: line.y,
      hovertemplate: "%{y:.3g}", marker: { size: 4 }, line: { color: c[line.colour], width: 1.8, dash: DASHES[line.colour] ?? "solid" },
    }];
  });
  show(plot, drawn, layout, whole, [[head, 0]]);
}

function drawCurve(plot) {
  const curve = FIGURES.curve;
  const x = curve.pressure_mpa;
  drawLines(plot, [
    { name: "measured", x, y: curve.measured, low: curve.low, high: curve.high, colour: "measured" },
    { name: "frozen", x, y: curve.frozen, colour: "frozen" },
    { name: "fitted", x, y: curve.fitted, colour: "after" },
  ], 320, "brake pressure [MPa], mean over 0.3 s", "deceleration [m/s²], decrease of speed over 0.3 s");
}

function drawSpline(plot) {
  const spline = FIGURES.spline;
  const line = (of) => ({ name: of, x: spline.x, y: spline[of].values, low: spline[of].low, high: spline[of].high, colour: of });
  drawLines(plot, [line("frozen"), line("after")], 280, spline.x_name, spline.y_name);
}

function drawCorrelation(plot) {
  const c = FIGURES.correlation[plot.dataset.correlation];
  const flat = (value) => c.lag_s.map(() => value);
  drawLines(plot, [
    { name: "band", x: c.lag_s, y: flat(0), low: flat(-c.band), high: flat(c.band), colour: "soft" },
    { name: "frozen", x: c.lag_s, y: c.frozen, colour: "frozen" },
    { name: "after", x: c.lag_s, y: c.after, colour: "after" },
  ], 200, "the residual follows the pressure by [s]", "correlation [1]");
}

/** Bars over a logarithmic axis, the largest on top; the words stand above their bars, so that a narrow screen has room. */
function drawGains(plot) {
  const c = colours();
  const gains = FIGURES.gains;
  const height = 40 * gains.length;
  const most = Math.log10(Math.max(...gains.flatMap((g) => [g.frozen, g.after]))) + 0.1;
  const whole = [-1, most];
  const layout = baseLayout(c, height, "gain of a spline", whole);
  layout.margin = { ...MARGIN, l: 12 };
  layout.dragmode = false;
  layout.hovermode = "closest";
  layout.bargap = 0.55;
  layout.xaxis = { ...layout.xaxis, type: "log", fixedrange: true, dtick: 1, range: whole };
  layout.yaxis = { autorange: "reversed", fixedrange: true, showticklabels: false, type: "category" };
  layout.annotations = gains.map((g) => ({
    x: 0, xref: "paper", y: g.name, yshift: 15, text: g.name, showarrow: false, xanchor: "left", font: { size: 11, color: c.soft },
  }));
  const bars = ["frozen", "after"].map((of) => ({
    type: "bar", orientation: "h", name: of, y: gains.map((g) => g.name), x: gains.map((g) => g[of] - 0.1), base: 0.1,
    customdata: gains.map((g) => g[of]), hovertemplate: "%{customdata:.3g}", marker: { color: c[of] },
  }));
  show(plot, bars, layout, whole, []);
}

function show(plot, lines, layout, whole, heads) {
  plot.whole = whole;
  Plotly.react(plot, lines, layout, CONFIG);
  plot.querySelectorAll(".panel-name").forEach((head) => head.remove());
  for (const [text, top] of heads) {
    const head = document.createElement("div");
    head.className = "panel-name";
    head.style.top = `${MARGIN.t + top}px`;
    head.textContent = text;
    plot.append(head);
  }
}

/** Zoom or move along the horizontal axis, never beyond the whole. */
function act(plot, what) {
  const [from, to] = plot.layout.xaxis.range.map(Number);
  const [first, last] = plot.whole;
  const factor = { in: 0.5, out: 2 }[what] ?? 1;
  const width = what === "whole" ? last - first : Math.min((to - from) * factor, last - first);
  const middle = (from + to) / 2 + ({ left: -0.25, right: 0.25 }[what] ?? 0) * width;
  const start = Math.min(Math.max(middle - width / 2, first), last - width);
  Plotly.relayout(plot, { "xaxis.range": [start, start + width] });
}

const DRAWN = [["curve", drawCurve], ["spline", drawSpline], ["correlation", drawCorrelation], ["gains", drawGains]];
const plots = [...document.querySelectorAll(".plot")];
const chips = [...document.querySelectorAll("[data-model]")];

function drawAll() {
  const shown = chips.filter((chip) => chip.getAttribute("aria-pressed") === "true").map((chip) => chip.dataset.model);
  for (const plot of plots) {
    const drawn = DRAWN.find(([kind]) => kind in plot.dataset);
    if (drawn) drawn[1](plot);
    else drawRun(plot, FIGURES.runs[Number(plot.dataset.run)], shown);
  }
}

for (const chip of chips) {
  chip.addEventListener("click", () => {
    chip.setAttribute("aria-pressed", String(chip.getAttribute("aria-pressed") !== "true"));
    drawAll();
  });
}
for (const plot of plots) {
  plot.addEventListener("keydown", (event) => {
    if (event.ctrlKey || event.metaKey || event.altKey || !(event.key in KEYS) || "gains" in plot.dataset) return;
    event.preventDefault();
    act(plot, KEYS[event.key]);
  });
  plot.closest("figure").querySelector(".zoom")?.addEventListener("click", (event) => {
    const button = event.target.closest("[data-act]");
    if (button) act(plot, button.dataset.act);
  });
}
dark.addEventListener("change", drawAll);
drawAll();
