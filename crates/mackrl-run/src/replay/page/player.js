// Time, choices and keys.

const current = { step: 0, time: 0, group: [], entity: null, known: null, fields: "group", speed: 4, playing: false, openOthers: false };
const last = data.frames.length - 1;

function showStep() {
  const { step } = current;
  byId("scrub").value = step;
  byId("scrub").setAttribute("aria-valuetext", `step ${step} of ${last}`);
  byId("clock").textContent = `${step} / ${last}`;
  showAgents(); showKnowledge(); showDecision(); moveCursors(step);
  const living = (from, to) => { let count = 0; for (let e = from; e < to; e++) count += isAlive(step, e); return count; };
  canvas.setAttribute("aria-label", `Battle at step ${step} of ${last}: ${living(0, data.agents)} allies and ${living(data.agents, data.entities.length)} enemies alive`);
}

function goTo(step) {
  current.step = Math.max(0, Math.min(last, step));
  current.time = current.step;
  showStep(); draw(current.time);
}

function choose(group) { current.group = [...group].sort((a, b) => a - b); current.entity = null; showStep(); draw(current.time); }

function toggle(agent) {
  choose(current.group.includes(agent) ? current.group.filter((other) => other !== agent) : [...current.group, agent]);
}

/** When the frame before was drawn, by the clock of frames; null at the first. */
let before = null;
function tick(now) {
  if (!current.playing) return;
  const passed = before === null ? 0 : Math.max(0, Math.min(now - before, 250));
  current.time = Math.min(last, current.time + passed / 1000 * current.speed);
  before = now;
  const step = Math.floor(current.time);
  if (step !== current.step) { current.step = step; showStep(); }
  draw(still.matches ? current.step : current.time);
  if (current.time >= last) play(false); else requestAnimationFrame(tick);
}

function play(on) {
  if (on && current.step >= last) goTo(0);
  current.playing = on;
  byId("play").textContent = on ? "❚❚" : "▶";
  byId("play").setAttribute("aria-label", on ? "Pause" : "Play");
  // What changes many times a second is not read out.
  for (const id of ["verdict", "why"]) byId(id).setAttribute("aria-live", on ? "off" : "polite");
  if (on) { before = null; requestAnimationFrame(tick); } else goTo(current.step);
}

function changeSpeed(by) {
  const select = byId("speed");
  select.selectedIndex = Math.max(0, Math.min(select.options.length - 1, select.selectedIndex + by));
  current.speed = Number(select.value);
}

function nextPair() {
  const decision = data.decisions[current.step];
  const pairs = decision ? decision.pairs.filter((pair) => pair.choice).map((pair) => pair.members) : [];
  if (pairs.length === 0) return;
  const now = pairs.findIndex((pair) => pair.join() === current.group.join());
  choose(pairs[(now + 1) % pairs.length]);
}

function changeFields() {
  const select = byId("fields");
  select.selectedIndex = (select.selectedIndex + 1) % select.options.length;
  current.fields = select.value;
  draw(current.time);
}

function onKey(event) {
  if (event.ctrlKey || event.metaKey || event.altKey) return;
  const tag = event.target.tagName, key = event.key;
  if (tag === "SELECT" || (tag === "INPUT" && key.startsWith("Arrow")) || ((tag === "BUTTON" || tag === "SUMMARY") && (key === " " || key === "Enter"))) return;
  const stride = event.shiftKey ? 10 : 1;
  const letter = key.length === 1 && key.toLowerCase() === key ? data.entities.slice(0, data.agents).findIndex((unit) => unit.name.toLowerCase() === key) : -1;
  if (key === " ") play(!current.playing);
  else if (key === "ArrowLeft") goTo(current.step - stride);
  else if (key === "ArrowRight") goTo(current.step + stride);
  else if (key === "Home") goTo(0);
  else if (key === "End") goTo(last);
  else if (key === "-") changeSpeed(-1);
  else if (key === "+" || key === "=") changeSpeed(1);
  else if (key === "Escape") choose([]);
  else if (letter >= 0) toggle(letter);
  else if (key === "n") nextPair();
  else if (key === "f") changeFields();
  else return;
  event.preventDefault();
}

function setTheme(theme) { document.documentElement.dataset.theme = theme; readColours(); }

function start() {
  document.title = byId("title").textContent = data.title;
  byId("subtitle").textContent = data.subtitle;
  byId("scrub").max = last;
  const dark = window.matchMedia("(prefers-color-scheme: dark)");
  setTheme(dark.matches ? "dark" : "light");
  dark.addEventListener("change", () => { setTheme(dark.matches ? "dark" : "light"); draw(current.time); });
  byId("theme").addEventListener("click", () => { setTheme(document.documentElement.dataset.theme === "dark" ? "light" : "dark"); draw(current.time); });
  byId("scrub").addEventListener("input", () => goTo(Number(byId("scrub").value)));
  byId("play").addEventListener("click", () => play(!current.playing));
  byId("back").addEventListener("click", () => goTo(current.step - 1));
  byId("forth").addEventListener("click", () => goTo(current.step + 1));
  byId("speed").addEventListener("change", () => changeSpeed(0));
  byId("fields").addEventListener("change", () => { current.fields = byId("fields").value; draw(current.time); });
  let drag = null;
  canvas.addEventListener("wheel", (event) => {
    if (!event.ctrlKey) return;
    event.preventDefault();
    const frame = canvas.getBoundingClientRect();
    zoomAt(event.clientX - frame.left, event.clientY - frame.top, Math.exp(-event.deltaY / 300));
    draw(current.time);
  }, { passive: false });
  canvas.addEventListener("dblclick", () => { resize(); draw(current.time); });
  canvas.addEventListener("pointerdown", (event) => { drag = { x: event.clientX, y: event.clientY, moved: false }; });
  window.addEventListener("pointermove", (event) => {
    if (!drag || !event.buttons || scale.unit <= scale.fit) return;
    const [right, down] = [event.clientX - drag.x, event.clientY - drag.y];
    if (!drag.moved && Math.hypot(right, down) < 4) return;
    drag = { x: event.clientX, y: event.clientY, moved: true };
    shiftBy(right, down); draw(current.time);
  });
  canvas.addEventListener("click", (event) => {
    const wasDragged = drag && drag.moved;
    drag = null;
    if (wasDragged) return;
    const frame = canvas.getBoundingClientRect();
    const { entity, pair } = hit(event.clientX - frame.left, event.clientY - frame.top);
    if (pair) choose(pair.members);
    else if (entity === undefined) return;
    else if (entity < data.agents) toggle(entity);
    else { current.entity = entity; showKnowledge(); draw(current.time); }
  });
  document.addEventListener("keydown", onKey);
  // In the next frame: a canvas that changes its height while sizes are reported would be reported again.
  new ResizeObserver(() => requestAnimationFrame(() => { resize(); draw(current.time); })).observe(canvas.parentElement);
  buildAgents(); addPlots(); resize();
  current.step = current.time = Math.min(data.start, last);
  current.known = knowledgeOf(current.step, []);
  nextPair();
  if (current.group.length === 0) choose(data.agents > 1 ? [0, 1] : [0]);
}

start();
