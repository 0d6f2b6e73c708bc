/* global Plotly */
"use strict";
// Residuals of held-out runs and the brake's curve: drawn in the page's colours, zoomed by pointer, buttons and keys.

const FIGURES = JSON.parse(document.getElementById("figures").textContent);
const PANEL_PX = 150;
const PRESSURE_PX = 84;
const HEAD_PX = 20;
const MARGIN = { l: 52, r: 12, t: 4, b: 40 };
const DASHES = { frozen: "dot", retuned: "dash", after: "solid" };
const NAMES = { frozen: "frozen", retuned: "re-tuned", after: "after" };
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
    frozen: of("--none"), retuned: of("--b"), after: of("--a"), measured: of("--ink"),
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
    for (const model of shown) {
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

function drawCurve(plot) {
  const c = colours();
  const curve = FIGURES.curve;
  const x = curve.pressure_mpa;
  const most = Math.max(...x, 0.1) * 1.03;
  const whole = [-0.02 * most, most];
  const layout = baseLayout(c, 320, "brake pressure [MPa], mean over 0.3 s", plot.layout?.xaxis?.range ?? whole);
  layout.yaxis = { ...yAxis(c, HEAD_PX, 320, 320), nticks: 7 };
  const line = (key, name, extra) => ({
    type: "scatter", mode: "lines+markers", name, x, y: curve[key], hovertemplate: "%{y:.3g}", marker: { size: 4 },
    line: { color: c[key] ?? c.after, width: 1.8 }, ...extra,
  });
  const edge = { mode: "lines", line: { width: 0 }, hoverinfo: "skip", hovertemplate: null };
  show(plot, [
    line("low", "", edge),
    line("high", "", { ...edge, fill: "tonexty", fillcolor: `${c.soft}38` }),
    line("frozen", "frozen", { line: { color: c.frozen, width: 1.6, dash: "dot" } }),
    line("measured", "measured"),
    line("fitted", "fitted"),
  ], layout, whole, [["deceleration [m/s²], decrease of speed over 0.3 s", 0]]);
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

const plots = [...document.querySelectorAll(".plot")];
const chips = [...document.querySelectorAll("[data-model]")];

function drawAll() {
  const shown = chips.filter((chip) => chip.getAttribute("aria-pressed") === "true").map((chip) => chip.dataset.model);
  for (const plot of plots) {
    if ("curve" in plot.dataset) drawCurve(plot);
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
    if (event.ctrlKey || event.metaKey || event.altKey || !(event.key in KEYS)) return;
    event.preventDefault();
    act(plot, KEYS[event.key]);
  });
  plot.closest("figure").querySelector(".zoom").addEventListener("click", (event) => {
    const button = event.target.closest("[data-act]");
    if (button) act(plot, button.dataset.act);
  });
}
dark.addEventListener("change", drawAll);
drawAll();
