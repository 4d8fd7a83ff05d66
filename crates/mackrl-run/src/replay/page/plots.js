// Curves of the whole episode, with a cursor at the step that is shown. A click goes to a step.

const plots = [];

function svgElement(name, attributes) {
  const element = document.createElementNS("http://www.w3.org/2000/svg", name);
  for (const [key, value] of Object.entries(attributes)) element.setAttribute(key, value);
  return element;
}

/** Adds a plot of some curves: { points, style, name }, null where there is no number. Names are shown where there are several. */
function addPlot(title, curves, describe) {
  const numbers = curves.flatMap((curve) => curve.points).filter((y) => y !== null && Number.isFinite(y));
  if (numbers.length === 0) return;
  const low = Math.min(0, ...minMax(numbers)), high = Math.max(...minMax(numbers), low + 1e-6);
  const [width, height] = [300, 74];
  const last = Math.max(1, data.frames.length - 1);
  const toX = (step) => 2 + (width - 4) * step / last;
  const toY = (y) => height - 5 - (height - 10) * (y - low) / (high - low);
  const svg = svgElement("svg", { viewBox: `0 0 ${width} ${height}`, preserveAspectRatio: "none", "aria-hidden": "true" });
  svg.append(svgElement("rect", { class: "frame", x: 1, y: 1, width: width - 2, height: height - 2 }));
  svg.append(svgElement("line", { class: "zero", x1: 0, x2: width, y1: toY(0), y2: toY(0) }));
  for (const curve of curves) {
    let path = "", pen = "M";
    curve.points.forEach((y, step) => {
      if (y === null) { pen = "M"; return; }
      path += `${pen}${toX(step).toFixed(1)} ${toY(y).toFixed(1)}`;
      pen = "L";
    });
    svg.append(svgElement("path", { class: `curve ${curve.style}`, d: path }));
  }
  const cursor = svgElement("line", { class: "cursor", y1: 0, y2: height });
  svg.append(cursor);
  const box = document.createElement("div"), heading = document.createElement("h3"), output = document.createElement("output");
  box.className = "plot";
  heading.append(title, output);
  const part = (className, ...words) => {
    const parts = words.map((word) => { const span = document.createElement("span"); span.append(...[word].flat()); return span; });
    const row = document.createElement("div");
    row.className = className;
    row.append(...parts);
    return row;
  };
  const tidy = (y) => y.toFixed(Math.abs(high) >= 10 ? 0 : Math.abs(high) >= 1 ? 1 : 2);
  const keys = curves.filter((curve) => curve.name).map((curve) => {
    const sample = svgElement("svg", { viewBox: "0 0 24 8", "aria-hidden": "true" });
    sample.append(svgElement("path", { class: `curve ${curve.style}`, d: "M0 4L24 4" }));
    return [sample, curve.name];
  });
  box.append(heading, part("key", ...keys), part("ends", tidy(high), tidy(low)), svg, part("steps", "0", "step", String(last)));
  document.getElementById("plots").append(box);
  svg.addEventListener("pointerdown", (event) => {
    const frame = svg.getBoundingClientRect();
    goTo(Math.round((event.clientX - frame.left) / frame.width * last));
  });
  plots.push({ cursor, toX, output, describe });
}

function minMax(numbers) {
  let [low, high] = [Infinity, -Infinity];
  for (const y of numbers) { low = Math.min(low, y); high = Math.max(high, y); }
  return [low, high];
}

const digits = (y, places) => (y === null || y === undefined ? "–" : y.toFixed(places));

function addPlots() {
  const values = data.decisions.map((decision) => decision.value);
  addPlot("Value V(s)", [{ points: values, style: "" }], (step) => digits(values[step], 2));
  addPlot("Reward", [{ points: data.rewards, style: "" }], (step) => digits(data.rewards[step], 3));
  const delegated = data.decisions.map((decision) => {
    const chosen = decision.pairs.filter((pair) => pair.choice);
    return chosen.length === 0 ? null : chosen.filter((pair) => pair.choice === "delegate").length / chosen.length;
  });
  const probability = data.decisions.map((decision) => {
    const chosen = decision.pairs.filter((pair) => pair.choice);
    return chosen.length === 0 ? null : chosen.reduce((sum, pair) => sum + pair.delegate, 0) / chosen.length;
  });
  addPlot("Delegation", [{ points: probability, style: "thin", name: "their mean probability of it" }, { points: delegated, style: "", name: "share of chosen pairs that delegate" }],
    (step) => `${digits(delegated[step], 2)} of pairs, p = ${digits(probability[step], 2)}`);
  const health = (from, to) => data.frames.map((frame) => frame.life.slice(from, to).reduce((sum, life) => sum + life, 0) / Math.max(1, to - from));
  const [allies, enemies] = [health(0, data.agents), health(data.agents, data.entities.length)];
  addPlot("Health", [{ points: allies, style: "", name: "allies" }, { points: enemies, style: "second", name: "enemies" }],
    (step) => `allies ${digits(allies[step], 2)}, enemies ${digits(enemies[step], 2)}`);
}

function moveCursors(step) {
  for (const plot of plots) {
    plot.cursor.setAttribute("x1", plot.toX(step));
    plot.cursor.setAttribute("x2", plot.toX(step));
    plot.output.textContent = plot.describe(step);
  }
}
