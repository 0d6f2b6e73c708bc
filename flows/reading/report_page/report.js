/* global REPORT, Traces, Player, telemetryOf, asCsv */
"use strict";
// The page: filters, the table of clips, and the chosen clip with its sibling.

const MOST_ROWS = 500;
const HASH = /^[0-9a-f]{16,}$/;
const $ = (id) => document.getElementById(id);
const clips = REPORT.clips;

function el(tag, properties = {}, ...children) {
  const { dataset = {}, ...rest } = properties;
  const node = Object.assign(document.createElement(tag), rest);
  Object.assign(node.dataset, dataset);
  node.append(...children);
  return node;
}

const number = (value, digits) => (value === null || value === undefined ? "–" : value.toFixed(digits));
const signed = (value, digits) => (value > 0 ? "+" : value < 0 ? "−" : "±") + Math.abs(value).toFixed(digits);
const degrees = (radians) => (radians === null || radians === undefined ? null : (radians * 180) / Math.PI);

const roadOf = ({ scenario: s }) => (s.hazard_height_m > 0 ? "hump" : s.hazard_height_m < 0 ? "depression" : "flat");
const verdictOf = ({ verdict: v }) => (v.passed === null ? "unjudged" : v.passed ? "passed" : "failed");

const TONES = { passed: "good", failed: "bad", unjudged: "unjudged" };

const COLUMNS = [
  { head: "clip", unit: "", key: (c) => c.label, text: (c) => c.label },
  { head: "rate", unit: "mm/h", key: (c) => c.scenario.precipitation_mm_h, text: (c) => String(c.scenario.precipitation_mm_h) },
  { head: "speed", unit: "km/h", key: (c) => c.scenario.initial_speed_km_h, text: (c) => number(c.scenario.initial_speed_km_h, 0) },
  { head: "μ", unit: "", key: (c) => c.figures.surface_friction, text: (c) => number(c.figures.surface_friction, 3) },
  { head: "stop", unit: "m", key: (c) => c.figures.stopping_distance, text: (c) => number(c.figures.stopping_distance, 1) },
  { head: "pitch", unit: "deg", key: (c) => c.figures.peak_pitch, text: (c) => number(degrees(c.figures.peak_pitch), 2) },
  { head: "check", unit: "", key: verdictOf, text: (c) => ({ passed: "✓", failed: "✗", unjudged: "–" })[verdictOf(c)] },
];

// ---- filters

const CHIPS = {
  weather: (c) => c.scenario.weather, hazard: roadOf, verdict: verdictOf,
  calibration: (c) => c.calibration, split: (c) => c.split,
};
const chosen = Object.fromEntries(Object.keys(CHIPS).map((name) => [name, new Set()]));
let order = { column: null, rising: true };

function drawChips() {
  for (const [name, of] of Object.entries(CHIPS)) {
    const values = [...new Set(clips.map(of))].filter(Boolean);
    $(name).hidden = values.length < 2;
    for (const value of values) {
      const chip = el("button", { type: "button", className: "chip", textContent: value, dataset: { value } });
      chip.setAttribute("aria-pressed", "false");
      chip.onclick = () => {
        chosen[name][chosen[name].has(value) ? "delete" : "add"](value);
        chip.setAttribute("aria-pressed", String(chosen[name].has(value)));
        drawRows();
      };
      $(name).append(chip);
    }
  }
}

function clearFilters() {
  $("filters").reset();
  Object.values(chosen).forEach((set) => set.clear());
  document.querySelectorAll(".chip").forEach((chip) => chip.setAttribute("aria-pressed", "false"));
  drawRows();
}

function kept() {
  const from = $("speed-from").valueAsNumber, to = $("speed-to").valueAsNumber;
  const words = $("search").value.toLowerCase().split(/\s+/).filter(Boolean);
  const list = clips.filter((c) =>
    Object.entries(CHIPS).every(([name, of]) => chosen[name].size === 0 || chosen[name].has(of(c)))
    && !(c.scenario.initial_speed_km_h < from) && !(c.scenario.initial_speed_km_h > to)
    && words.every((word) => c.label.toLowerCase().includes(word)));
  if (order.column === null) return list;
  const { key } = COLUMNS[order.column];
  const sign = order.rising ? 1 : -1;
  const missing = (v) => v === null || v === undefined;
  return list.sort((p, q) => {
    const a = key(p), b = key(q);
    if (missing(a) || missing(b)) return missing(a) - missing(b);
    return sign * (typeof a === "string" ? a.localeCompare(b, undefined, { numeric: true }) : a - b);
  });
}

// ---- table

function drawHead() {
  $("clips").tHead.append(el("tr", {}, ...COLUMNS.map(({ head, unit }, k) => {
    const button = el("button", { type: "button" }, head, el("small", { textContent: unit || "\u00a0" }));
    const cell = el("th", { scope: "col" }, button);
    button.onclick = () => {
      order = { column: k, rising: order.column === k ? !order.rising : true };
      [...cell.parentNode.cells].forEach((c, i) => c.setAttribute("aria-sort", i !== k ? "none" : order.rising ? "ascending" : "descending"));
      drawRows();
    };
    return cell;
  })));
}

/** A clip's own address, to be copied or opened in another tab; the row takes plain clicks and the keyboard. */
function linkTo(clip) {
  const link = el("a", { href: `#${encodeURIComponent(clip.clip_id)}`, tabIndex: -1, textContent: clip.label });
  link.onclick = (event) => {
    if (event.ctrlKey || event.metaKey || event.shiftKey) event.stopPropagation();
    else event.preventDefault();
  };
  return link;
}

function drawRows() {
  const list = kept();
  $("clips").tBodies[0].replaceChildren(...list.slice(0, MOST_ROWS).map((clip) => {
    const row = el("tr", { tabIndex: 0, dataset: { clip: clip.clip_id } },
      ...COLUMNS.map(({ text }, k) => el("td", {}, k === 0 ? linkTo(clip) : text(clip))));
    row.lastChild.className = TONES[verdictOf(clip)];
    row.lastChild.ariaLabel = verdictOf(clip);
    row.onclick = () => select(clip);
    row.onkeydown = (event) => {
      const next = { ArrowDown: row.nextSibling, ArrowUp: row.previousSibling, Enter: row }[event.key];
      if (!next) return;
      event.preventDefault();
      next.focus();
      next.click();
    };
    return row;
  }));
  const rest = list.length > MOST_ROWS ? `; the first ${MOST_ROWS} are listed` : "";
  $("count").textContent = `${list.length} of ${clips.length} clips${rest}`;
  markRows();
}

function markRows() {
  for (const row of $("clips").tBodies[0].rows) {
    row.setAttribute("aria-selected", String(row.dataset.clip === current.clip?.clip_id));
    row.classList.toggle("sibling", row.dataset.clip === current.sibling?.clip_id);
  }
}

// ---- the chosen clip and its sibling

const current = { clip: null, sibling: null };

/** Siblings of a clip: those that differ in exactly one control. */
function siblingsOf(clip) {
  const place = clips.indexOf(clip);
  return REPORT.pairs.filter(([i, j]) => i === place || j === place)
    .map(([i, j, control]) => ({ clip: clips[i === place ? j : i], control }));
}

function select(clip) {
  const siblings = siblingsOf(clip);
  const options = [el("option", { value: "", textContent: siblings.length ? "nothing" : "no sibling" })];
  for (const control of new Set(siblings.map((s) => s.control))) {
    options.push(el("optgroup", { label: `other ${control}` }, ...siblings.filter((s) => s.control === control)
      .map((s) => el("option", { value: s.clip.clip_id, textContent: s.clip.label }))));
  }
  $("sibling").replaceChildren(...options);
  // what was shown beside the last clip stays if it is a sibling of this one too; else the farthest in friction
  const apart = (s) => Math.abs(s.clip.figures.surface_friction - clip.figures.surface_friction);
  const same = siblings.find((s) => s.clip === current.sibling);
  const far = siblings.filter((s) => s.control === "weather").sort((p, q) => apart(q) - apart(p))[0];
  return beside(clip, (same ?? far ?? siblings[0])?.clip ?? null);
}

async function beside(clip, sibling) {
  Object.assign(current, { clip, sibling });
  $("sibling").value = sibling?.clip_id ?? "";
  $("label").textContent = clip.label;
  $("badge").className = `badge ${TONES[verdictOf(clip)]}`;
  $("badge").textContent = { passed: "pose check passed", failed: "pose check failed", unjudged: "not judged" }[verdictOf(clip)];
  $("labels").replaceChildren([...LABELS.map((label) => ranged(clip, ...label)), stopMissing(clip)].filter(Boolean).join(" · "),
    " ", el("small", { textContent: "in brackets p05 to p95" }));
  $("reasons").hidden = clip.verdict.reasons.length === 0;
  $("reasons").className = TONES[verdictOf(clip)];
  $("reasons").textContent = clip.verdict.reasons.join("; ");
  $("changes").textContent = sibling ? changes(clip, sibling) : "";
  history.replaceState(null, "", `#${clip.clip_id}${sibling ? `+${sibling.clip_id}` : ""}`);
  markRows();
  drawClipFacts(clip);
  const pair = [clip, sibling].filter(Boolean);
  const films = pair.map((c) => c.film).filter(Boolean);
  $("films").hidden = films.length === 0;
  $("films").classList.toggle("alone", films.length < 2);
  document.querySelector("figure.b").hidden = films.length < 2;
  document.querySelectorAll("figcaption").forEach((caption, k) => { caption.textContent = pair[k]?.label ?? ""; });
  player.load(films);
  const traced = clip.traced ? pair.filter((c) => c.traced) : [];
  $("player").hidden = !clip.traced;
  $("horizon").hidden = !REPORT.horizon || films.length === 0;
  $("untraced").hidden = pair.every((c) => c.traced);
  $("untraced").textContent = `No traces of ${pair.filter((c) => !c.traced).map((c) => c.label).join(" and ")} in this report: `
    + "musync report with --clip brings those that you name.";
  const columns = await Promise.all(traced.map(telemetryOf));
  if (current.clip !== clip || current.sibling !== sibling) return;
  await traces.show(traced.map((c, k) => ({ label: c.label, columns: columns[k] })));
  traces.point(player.time);
  drawHorizons(player.time);
  $("boxes").hidden = !traces.shown.some(({ columns }) => Object.keys(columns.boxes).length);
  drawBoxes(player.time);
}

const LABELS = [["impact", "impact_speed", 1, " km/h", 3.6], ["friction", "surface_friction", 3, "", 1], ["stop", "stopping_distance", 1, " m", 1], ["peak pitch", "peak_pitch", 2, "°", 180 / Math.PI]];

/** A label with its p05 and p95 under the surface's bounds; empty if the clip has no such figure. */
function ranged({ figures }, name, key, digits, unit, factor) {
  const text = (k) => (typeof figures[k] === "number" ? (figures[k] * factor).toFixed(digits) : null);
  const [low, high] = [text(`${key}_p05`), text(`${key}_p95`)];
  const range = low === null && high === null ? "" : ` (${low ?? "–"} to ${high ?? "longer than the clip"})`;
  return text(key) === null ? "" : `${name} ${text(key)}${unit}${range}`;
}

/** Why a clip has no stopping distance, in words; empty if it has one. */
function stopMissing({ scenario, figures }) {
  if (typeof figures.stopping_distance === "number") return "";
  return scenario.peak_pressure_mpa > 0 || REPORT.driven ? "no stop within the clip" : "does not brake";
}

/** What the sibling changes, in words: the controls, then the figures that both have. */
function changes(clip, sibling) {
  const parts = LABELS
    .filter(([, key]) => typeof clip.figures[key] === "number" && typeof sibling.figures[key] === "number")
    .map(([name, key, digits, unit, factor]) => `${name} ${signed((sibling.figures[key] - clip.figures[key]) * factor, digits)}${unit}`);
  if (!stopMissing(clip) && stopMissing(sibling)) parts.push(stopMissing(sibling));
  const read = ({ scenario }, key) => (key === "objects" ? JSON.stringify(scenario[key] ?? []) : scenario[key] ?? "–");
  const turned = [...new Set([...Object.keys(clip.scenario), ...Object.keys(sibling.scenario)])]
    .filter((key) => read(clip, key) !== read(sibling, key))
    .map((key) => (key === "objects" ? "other road users" : `${key} ${read(clip, key)} → ${read(sibling, key)}`));
  return `${sibling.label} beside it: ${turned.join(", ")}. This changes ${parts.join(", ") || "no figure that both have"}.`;
}

// ---- facts

const facts = (values) => el("table", { className: "facts" }, ...Object.entries(values).map(([name, value]) =>
  el("tr", {}, el("th", { scope: "row", textContent: name }), el("td", { className: HASH.test(value) ? "hash" : "", textContent: value ?? "–" }))));

function drawClipFacts(clip) {
  const { clip_id, seed, split, calibration } = clip;
  const parts = {
    "": { clip_id, seed, split: split || "none", calibration }, "Scenario": clip.scenario, "Outcome": clip.figures,
    "Pose check": { ...clip.verdict, reasons: clip.verdict.reasons.join("; ") || "none" }, "SHA-256 of the content": clip.content,
  };
  $("clip-facts").lastElementChild.replaceChildren(...Object.entries(parts).flatMap(([title, values]) =>
    [...(title ? [el("h3", { textContent: title })] : []), facts(values)]));
}

// ---- the horizon, exaggerated

const EXAGGERATION = 5;

/** Over each film: dashed, where the horizon of a level car stands; solid, where it would stand if the body pitched five times as much. */
function drawHorizons(time) {
  document.querySelectorAll("svg.horizon").forEach((svg, k) => {
    const pitch = traces.shown[k]?.columns.get("pitch");
    const shown = Boolean($("horizon").firstElementChild.checked && !$("horizon").hidden && pitch);
    svg.toggleAttribute("hidden", !shown);
    if (!shown) return;
    const { level, per_slope } = REPORT.horizon;
    const now = pitch[Math.min(Math.round(time * REPORT.tick_rate_hz), pitch.length - 1)];
    for (const [line, y] of [[svg.children[0], level], [svg.children[1], level - EXAGGERATION * per_slope * Math.tan(now)]]) {
      line.setAttribute("y1", `${100 * y}%`);
      line.setAttribute("y2", `${100 * y}%`);
    }
  });
}

// ---- road users

const SVG = "http://www.w3.org/2000/svg";

function svg(name, attributes, text = "") {
  const node = document.createElementNS(SVG, name);
  for (const [key, value] of Object.entries(attributes)) node.setAttribute(key, value);
  node.textContent = text;
  return node;
}

/** Over each film: the box and kind of each road user in the frame that it shows. */
function drawBoxes(time) {
  document.querySelectorAll("svg.boxes").forEach((overlay, k) => {
    const film = overlay.parentElement.querySelector("video");
    const frames = traces.shown[k]?.columns.boxes ?? {};
    const last = Math.round(film.duration * REPORT.frame_rate_hz) - 1;
    const now = frames[Math.min(Math.floor(time * REPORT.frame_rate_hz + 1e-6), last)] ?? [];
    overlay.setAttribute("viewBox", `0 0 ${film.videoWidth || 1} ${film.videoHeight || 1}`);
    overlay.replaceChildren(...($("boxes").firstElementChild.checked ? now : []).flatMap(([kind, left, top, right, bottom]) => [
      svg("rect", { x: left, y: top, width: right - left, height: bottom - top }),
      svg("text", { x: left, y: top - 3 }, kind),
    ]));
  });
}

// ---- one time for all

const player = new Player([$("film-a"), $("film-b")], (time) => {
  $("time").value = time;
  $("clock").textContent = `${time.toFixed(2)} s of ${REPORT.duration_s.toFixed(1)} s`;
  $("play").textContent = player.running ? "Pause" : "Play";
  $("play").ariaLabel = $("play").textContent;
  traces.point(time);
  drawHorizons(time);
  drawBoxes(time);
});
const traces = new Traces($("traces"), (time) => scrub(time));

function scrub(time) {
  if (player.running) player.pause();
  player.seek(time);
}

async function saveCsv() {
  const { clip } = current;
  const text = asCsv(clip, await telemetryOf(clip));
  const link = el("a", { href: URL.createObjectURL(new Blob([text], { type: "text/csv" })), download: `${clip.label.replaceAll("/", "_")}.csv` });
  link.click();
  URL.revokeObjectURL(link.href);
}

// ---- start

$("time").max = REPORT.duration_s;
const speeds = clips.map((c) => c.scenario.initial_speed_km_h);
$("speed-from").placeholder = Math.floor(Math.min(...speeds));
$("speed-to").placeholder = Math.ceil(Math.max(...speeds));
drawChips();
drawHead();
$("filters").addEventListener("input", drawRows);
$("reset").onclick = clearFilters;
$("sibling").onchange = () => beside(current.clip, clips.find((c) => c.clip_id === $("sibling").value) ?? null);
$("play").onclick = () => (player.running ? player.pause() : player.play());
$("time").oninput = () => scrub($("time").valueAsNumber);
$("csv").title = "Every telemetry column of this clip, a row a millisecond";
$("csv").onclick = saveCsv;
$("horizon").title = "Dashed: the horizon of a level car. Solid: with five times the body's pitch; it rises as the nose goes down.";
$("horizon").onchange = () => drawHorizons(player.time);
$("boxes").onchange = () => drawBoxes(player.time);
addEventListener("keydown", (event) => {
  if (event.target.closest("input, select, button, table, summary")) return;
  const step = { ArrowLeft: -1, ArrowRight: 1 }[event.key];
  if (step) scrub(player.time + step / REPORT.frame_rate_hz);
  else if (event.key === " ") $("play").click();
  else return;
  event.preventDefault();
});
/** #CLIP opens the page at a clip, #CLIP+SIBLING at a pair. */
async function openAddress() {
  const [first, second] = location.hash.slice(1).split("+").map((id) => clips.find((c) => c.clip_id === decodeURIComponent(id)));
  await select(first ?? clips[0]);
  if (first && second) await beside(first, second);
}
addEventListener("hashchange", openAddress);
drawRows();
openAddress().finally(() => { document.body.dataset.ready = "true"; });
