"use strict";
const COLOURS = ["#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#7a5195", "#8c8c00"];
const GROUPS = [["Greedy tests", /^test_/], ["Do controllers and critic read what they see?", /^(saturation_|logit_|entropy_share_|explained_variance)/], ["Training", /^[^/]*$/], ["Controllers", /^mackrl\//], ["Speed and system", /^sys\//], ["Others", /./]];
/** Settings that tell repetitions, and not experiments, apart. */
const OF_SEEDS = new Set(["run.seed"]);
const GRID = 300;
const runs = new Map(), charts = new Map();
const byId = (id) => document.getElementById(id);
const make = (name, properties = {}, ...children) => { const element = Object.assign(document.createElement(name), properties); element.append(...children); return element; };
const ink = (name) => getComputedStyle(document.documentElement).getPropertyValue(name).trim();
const short = (y) => y == null ? "–" : y === 0 ? "0" : Math.abs(y) >= 1e6 ? (y / 1e6).toFixed(2) + "M" : Math.abs(y) >= 1e4 ? (y / 1e3).toFixed(0) + "k" : Math.abs(y) >= 100 ? y.toFixed(0) : y.toPrecision(3);

/** What a run is a repetition of. */
const experiment = (run) => JSON.stringify(Object.entries(run.settings).filter(([key]) => !OF_SEEDS.has(key)));

/** Keys of settings in which the runs differ. */
function differing(all) {
  const keys = new Set(all.flatMap((run) => Object.keys(run.settings)));
  return [...keys].filter((key) => new Set(all.map((run) => run.settings[key])).size > 1);
}

/** Adds the rows that were written since the last time. */
async function follow(run) {
  for (;;) {
    const answer = await fetch(`runs/${run.id}/rows.json?from=${run.bytes}`);
    if (!answer.ok) { if (run.bytes > 0) Object.assign(run, { bytes: 0, curves: {}, latest: null }); return; }
    const { rows, next, problem } = await answer.json();
    if (problem) run.rowProblem = problem;
    for (const row of rows) {
      if (!Number.isFinite(row.t_env)) continue;
      run.latest = row;
      for (const [name, y] of Object.entries(row))
        if (name !== "t_env" && Number.isFinite(y)) { const curve = run.curves[name] ??= { x: [], y: [] }; if (!(curve.x.at(-1) >= row.t_env)) { curve.x.push(row.t_env); curve.y.push(y); } }
    }
    const isAll = next === run.bytes || rows.length === 0;
    run.bytes = next;
    if (isAll) return;
  }
}

function smoothed(y) {
  const keep = Number(byId("smoothing").value);
  let before = y[0];
  return y.map((value) => before = keep * before + (1 - keep) * value);
}

/** A curve at the places of a grid, straight from point to point, nothing beyond its ends. */
function resampled({ x, y }, grid) {
  let i = 0;
  return grid.map((at) => {
    if (at < x[0] || at > x.at(-1)) return null;
    while (i + 1 < x.length && x[i + 1] < at) i++;
    if (i + 1 >= x.length || x[i] === at) return y[i];
    return y[i] + (y[i + 1] - y[i]) * (at - x[i]) / (x[i + 1] - x[i]);
  });
}

/** Curves of a metric as columns for a chart: [x, ...], and the series that they are. */
function columns(name) {
  const shown = [...runs.values()].filter((run) => run.isShown && run.curves[name]);
  const right = Math.max(...shown.map((run) => run.curves[name].x.at(-1)), 1), left = Math.min(...shown.map((run) => run.curves[name].x[0]), right);
  const grid = Array.from({ length: GRID + 1 }, (_, i) => left + (right - left) * i / GRID);
  const curve = (run) => resampled({ x: run.curves[name].x, y: smoothed(run.curves[name].y) }, grid);
  const data = [grid], series = [{ label: "steps", value: (_, x) => short(x) }], bands = [];
  if (!byId("bands").checked) {
    for (const run of shown) { data.push(curve(run)); series.push({ label: run.name, stroke: run.colour, width: 1.6, value: (_, y) => short(y) }); }
    return { data, series, bands };
  }
  const together = Map.groupBy ? Map.groupBy(shown, experiment) : shown.reduce((map, run) => map.set(experiment(run), [...(map.get(experiment(run)) || []), run]), new Map());
  for (const members of together.values()) {
    const each = members.map(curve), rows = grid.map((_, i) => each.map((y) => y[i]).filter((y) => y != null));
    // As in `mackrl plot`: from where all have begun to where the shortest ends.
    const mean = rows.map((ys) => ys.length === members.length ? ys.reduce((a, b) => a + b, 0) / ys.length : null);
    const error = rows.map((ys, i) => ys.length > 1 && mean[i] != null ? Math.sqrt(ys.reduce((sum, y) => sum + (y - mean[i]) ** 2, 0) / (ys.length - 1) / ys.length) : 0);
    const colour = members[0].colour, first = data.length;
    data.push(mean);
    series.push({ label: `${members[0].group} [${members.length}]`, stroke: colour, width: 1.8, value: (_, y) => short(y) });
    if (members.length > 1) {
      for (const sign of [1, -1]) { data.push(mean.map((y, i) => y == null ? null : y + sign * error[i])); series.push({ label: `${members[0].group} ${sign > 0 ? "+" : "−"}`, class: "band", stroke: "transparent", width: 0, points: { show: false }, value: (_, y) => short(y) }); }
      bands.push({ series: [first + 1, first + 2], fill: colour + "33" });
    }
  }
  return { data, series, bands };
}

function drawPlot(name) {
  const { data, series, bands } = columns(name);
  const old = charts.get(name), key = JSON.stringify(series.map((one) => [one.label, one.stroke]));
  if (old && old.key === key) { const zoomed = old.zoomed; old.chart.setData(data, !zoomed); if (zoomed) old.chart.setScale("x", zoomed); return old.box; }
  const box = old ? old.box : make("section", { className: "plot" });
  if (old) old.chart.destroy();
  box.replaceChildren(make("h3", { textContent: name }));
  const axis = { stroke: ink("--faint"), grid: { stroke: ink("--line"), width: 1 }, ticks: { stroke: ink("--line"), width: 1 } };
  const entry = { box, key, zoomed: null };
  const options = {
    width: Math.max(280, Math.min(640, document.documentElement.clientWidth - 60)), height: 230, series, bands, scales: { x: { time: false } }, legend: { live: true },
    axes: [{ ...axis, values: (_, ticks) => ticks.map(short), space: 70 }, { ...axis, size: 52, values: (_, ticks) => ticks.map(short) }],
    cursor: { sync: { key: "runs" }, drag: { x: true, y: false } },
    hooks: { setScale: [(chart, scale) => { const { min, max } = chart.scales.x, xs = chart.data[0]; if (scale === "x") entry.zoomed = min > xs[0] || max < xs.at(-1) ? { min, max } : null; }] },
  };
  entry.chart = new uPlot(options, data, box);
  charts.set(name, entry);
  return box;
}

function fit() {
  for (const { chart, box } of charts.values()) { const width = box.clientWidth - 24; if (width > 100 && Math.abs(width - chart.width) > 2) chart.setSize({ width, height: 230 }); }
}

function drawPlots() {
  const names = [...new Set([...runs.values()].filter((run) => run.isShown).flatMap((run) => Object.keys(run.curves)))].sort();
  for (const [name, { chart }] of charts) if (!names.includes(name)) { chart.destroy(); charts.delete(name); }
  const left = new Set(names), sections = [];
  for (const [title, pattern] of GROUPS) {
    const own = [...left].filter((name) => pattern.test(name));
    own.forEach((name) => left.delete(name));
    if (own.length) sections.push(make("h2", { textContent: title }), make("div", { className: "plots" }, ...own.map(drawPlot)));
  }
  if (!sections.length) sections.push(make("p", { className: "warn", textContent: runs.size === 0 ? "No runs are shown: none was found." : [...runs.values()].some((run) => run.isShown) ? "No curves yet: no run has a row of metrics that can be used." : "No curves: no run is ticked." }));
  byId("plots").replaceChildren(...sections);
  fit();
}

function showRuns(problems) {
  const all = [...runs.values()], keys = differing(all).filter((key) => !OF_SEEDS.has(key)), colours = new Map();
  for (const run of all) {
    const own = experiment(run);
    if (!colours.has(own)) colours.set(own, COLOURS[colours.size % COLOURS.length]);
    const told = keys.filter((key) => key !== "algorithm.name" && all.every((other) => key in other.settings));
    run.group = [run.settings["algorithm.name"] || run.name, ...told.map((key) => `${key.split(".").at(-1)} ${run.settings[key]}`)].join(", ");
    run.colour = colours.get(own);
  }
  byId("problems").replaceChildren(...problems.map((text) => make("li", { textContent: text })));
  byId("runs").replaceChildren(...all.map((run) => {
    const tick = make("input", { type: "checkbox", checked: run.isShown });
    tick.addEventListener("change", () => { run.isShown = tick.checked; drawPlots(); });
    const key = make("i", { className: "key" });
    key.style.background = run.colour;
    const row = run.latest || {}, won = Number.isFinite(row.test_battle_won_mean) ? `, won ${(100 * row.test_battle_won_mean).toFixed(0)} % of the last test` : "";
    const says = make("span", { textContent: `${run.status}, ${row.t_env || 0} steps${won}` });
    const problem = run.problem || run.rowProblem;
    const links = run.replays.map((name) => make("a", { href: `runs/${run.id}/replays/${encodeURIComponent(name)}`, textContent: name.replace(".replay.gz", "") }));
    return make("div", { className: "run" }, make("label", {}, tick, key, run.name), says, ...(problem ? [make("span", { className: "warn", textContent: problem })] : []), ...links);
  }));
  const table = byId("settings").querySelector("table"), different = differing(all);
  const cells = (kind, words) => words.map((text) => make(kind, { textContent: text }));
  byId("settings").querySelector("summary").textContent = all.length > 1 ? `Settings in which the runs differ: ${different.length}` : "Settings";
  const shownKeys = all.length > 1 ? different : Object.keys((all[0] || { settings: {} }).settings);
  table.replaceChildren(make("tr", {}, ...cells("th", ["", ...all.map((run) => run.name)])), ...shownKeys.map((name) => make("tr", {}, ...cells("th", [name]), ...cells("td", all.map((run) => run.settings[name] ?? "–")))));
}

async function update() {
  try {
    const { runs: listed, problems } = await (await fetch("runs.json")).json();
    for (const id of [...runs.keys()]) if (!listed.some((run) => run.id === id)) runs.delete(id);
    for (const one of listed) {
      const run = runs.get(one.id) || { bytes: 0, curves: {}, isShown: true };
      runs.set(one.id, Object.assign(run, one));
    }
    await Promise.all([...runs.values()].map((run, i) => new Promise((go) => setTimeout(go, 4 * i)).then(() => follow(run)).catch(() => {})));
    const now = JSON.stringify([listed, problems, [...runs.values()].map((run) => run.bytes)]);
    if (now !== update.before) { update.before = now; if (!(document.activeElement && document.activeElement.closest("#runs"))) showRuns(problems); drawPlots(); }
  } catch (error) { byId("problems").replaceChildren(make("li", { textContent: `The server does not answer: ${error.message}` })); update.before = null; }
  setTimeout(update, 2000);
}
byId("bands").addEventListener("change", drawPlots);
byId("smoothing").addEventListener("input", drawPlots);
addEventListener("resize", fit);
matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => { for (const { chart } of charts.values()) chart.destroy(); charts.clear(); drawPlots(); });
update();
