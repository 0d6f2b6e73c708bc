/* global Plotly */
"use strict";
// The figures of a page: drawn in its colours and for its width, zoomed by pointer, buttons and keys, lines by the key.

const LEAST_PX = 300;
const GAP_PX = 64;
const KEYS = { "+": "in", "=": "in", "-": "out", "_": "out", ArrowLeft: "left", ArrowRight: "right", 0: "whole", Home: "whole" };
const CONFIG = { responsive: true, displaylogo: false, displayModeBar: false, doubleClick: false, scrollZoom: false };
const dark = matchMedia("(prefers-color-scheme: dark)");
const touched = matchMedia("(pointer: coarse)");
const hidden = new Set();

/** The style sheet's colour of a name. */
const colourOf = (name) => getComputedStyle(document.documentElement).getPropertyValue(name).trim();

/** Names of the style sheet's colours by their light value, in which figures come. */
const light = document.styleSheets[0].cssRules[0].style;
const NAMES = Object.fromEntries([...light].map((name) => [light.getPropertyValue(name).trim(), name]));

/** A part of a figure in the colours of the page; what follows the six digits of a colour is its opacity. */
const paint = (value) => JSON.parse(JSON.stringify(value), (key, shown) => {
  if (!key.endsWith("color")) return shown;
  const name = NAMES[shown.slice(0, 7)];
  if (name) return colourOf(name) + shown.slice(7);
  return shown.startsWith("--") ? colourOf(shown) : shown;
});

const STYLE = {
  margin: { l: 56, r: 12, t: 26, b: 40 }, showlegend: false,
  paper_bgcolor: "rgba(0,0,0,0)", plot_bgcolor: "rgba(0,0,0,0)", font: { family: "system-ui, sans-serif", size: 11, color: "--soft" },
  hoverlabel: { bgcolor: "--card", bordercolor: "--line", font: { color: "--ink" } },
  modebar: { bgcolor: "rgba(0,0,0,0)", color: "--soft", activecolor: "--ink" },
  template: { layout: {
    annotationdefaults: { font: { size: 12, color: "--ink" } },
    xaxis: { gridcolor: "--line", zeroline: false, title: { standoff: 5 }, hoverformat: ".2f" },
    yaxis: { gridcolor: "--line", zerolinecolor: "--soft", zerolinewidth: 1, nticks: 6, fixedrange: true, title: { standoff: 5 } },
  } },
};

const across = (plot) => Math.max(1, Math.min(plot.drawn.layout.grid.columns, Math.floor(plot.clientWidth / LEAST_PX)));
const axesOf = (plot) => Object.keys(plot.drawn.layout).filter((name) => name.startsWith("xaxis"));

/** Draw plot.drawn, a figure of the page writer, with plot.own layout and plot.config; again, it keeps what is zoomed to. */
function draw(plot) {
  const { data, layout } = plot.drawn;
  const columns = across(plot), rows = Math.ceil(axesOf(plot).length / columns);
  const grid = { ...layout.grid, rows, columns, xgap: (GAP_PX * columns) / plot.clientWidth };
  const height = (layout.height / layout.grid.rows) * rows + STYLE.margin.b;
  const ranges = plot.whole ? Object.fromEntries(axesOf(plot).map((name) => [name, { ...layout[name], range: [...plot._fullLayout[name].range] }])) : {};
  Plotly.react(plot,
    data.map(({ x, y, ...look }) => ({ ...paint(look), x, y, visible: !hidden.has(look.legendgroup) })),
    // a finger scrolls the page; it zooms by the buttons
    paint({ ...STYLE, dragmode: touched.matches ? false : "zoom", ...layout, ...ranges, grid, height, ...plot.own }),
    { ...CONFIG, ...plot.config });
  plot.across = columns;
  plot.whole ??= Object.fromEntries(axesOf(plot).map((name) => [name, plot._fullLayout[name].range.map(Number)]));
}

/** Zoom or move along the horizontal axes, never beyond the whole. */
function act(plot, what) {
  const ranges = axesOf(plot).map((name) => {
    const [from, to] = plot._fullLayout[name].range.map(Number);
    const [first, last] = plot.whole[name];
    const factor = { in: 0.5, out: 2 }[what] ?? 1;
    const width = what === "whole" ? last - first : Math.min((to - from) * factor, last - first);
    const middle = (from + to) / 2 + ({ left: -0.25, right: 0.25 }[what] ?? 0) * width;
    const start = Math.min(Math.max(middle - width / 2, first), last - width);
    return [`${name}.range`, [start, start + width]];
  });
  Plotly.relayout(plot, Object.fromEntries(ranges));
}

const plots = [...document.querySelectorAll(".drawn .plot")];
const chips = [...document.querySelectorAll("[data-line]")];
const drawAll = () => plots.forEach(draw);

for (const plot of plots) {
  const figure = plot.closest("figure");
  plot.drawn = JSON.parse(figure.querySelector("script").textContent);
  draw(plot);
  plot.on("plotly_doubleclick", () => act(plot, "whole"));
  plot.addEventListener("keydown", (event) => {
    if (event.ctrlKey || event.metaKey || event.altKey || !(event.key in KEYS)) return;
    event.preventDefault();
    act(plot, KEYS[event.key]);
  });
  figure.querySelector(".zoom").addEventListener("click", (event) => {
    const button = event.target.closest("[data-act]");
    if (button) act(plot, button.dataset.act);
  });
}
for (const chip of chips) {
  chip.addEventListener("click", () => {
    const name = chip.dataset.line;
    if (!hidden.delete(name)) hidden.add(name);
    chips.filter((other) => other.dataset.line === name).forEach((other) => other.setAttribute("aria-pressed", String(!hidden.has(name))));
    drawAll();
  });
}
dark.addEventListener("change", drawAll);
addEventListener("resize", () => plots.filter((plot) => across(plot) !== plot.across).forEach(draw));
