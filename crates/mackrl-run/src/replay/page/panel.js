// The panel: the group, what it knows, and what the controllers made of the step. All words are set as text, never as markup.

const byId = (id) => document.getElementById(id);

function make(tag, options = {}, ...children) {
  const element = document.createElement(tag);
  const { data: set, text, ...properties } = options;
  Object.assign(element, properties);
  Object.assign(element.dataset, set || {});
  if (text !== undefined) element.textContent = text;
  element.append(...children);
  return element;
}

function actionName(agent, action) {
  const plain = ["none (dead)", "stop", "north", "south", "east", "west"];
  if (action < plain.length) return plain[action];
  return data.entities[agent].heals ? `heal ${nameOf(action - plain.length)}` : `attack e${action - plain.length}`;
}

const percent = (p) => (p < 0.001 ? "<0.1 %" : (100 * p).toFixed(1) + " %");
const small = (p) => (p >= 0.001 ? p.toFixed(3) : p.toExponential(1));

function buildAgents() {
  for (let agent = 0; agent < data.agents; agent++) {
    const button = make("button", { type: "button", text: nameOf(agent), title: data.entities[agent].kind, data: { agent } });
    button.setAttribute("aria-label", `${nameOf(agent)}, ${data.entities[agent].kind}`);
    button.addEventListener("click", () => toggle(agent));
    byId("agents").append(button);
  }
}

function showAgents() {
  for (const button of byId("agents").children) {
    const agent = Number(button.dataset.agent);
    button.setAttribute("aria-pressed", String(current.group.includes(agent)));
    button.disabled = !isAlive(current.step, agent) && !current.group.includes(agent);
  }
}

function chip(entity, note) {
  const button = make("button", { type: "button", text: nameOf(entity) + (note ? ` (${note})` : ""), title: data.entities[entity].kind, data: { entity } });
  button.setAttribute("aria-pressed", String(entity === current.entity));
  button.addEventListener("click", () => { current.entity = entity; showKnowledge(); draw(current.time); });
  return button;
}

function showKnowledge() {
  current.known = knowledgeOf(current.step, current.group);
  const known = current.known;
  byId("verdict").textContent = verdictOf(current.group, known);
  const fill = (id, chips) => {
    const focused = document.activeElement && document.activeElement.closest(`#${id}`) ? document.activeElement.dataset.entity : undefined;
    byId(id).replaceChildren(...(chips.length > 0 ? chips : ["nothing"]));
    if (focused !== undefined) { const again = byId(id).querySelector(`[data-entity="${focused}"]`); if (again) again.focus(); }
  };
  fill("common", known.common.map((entity) => chip(entity)));
  fill("mutual", known.mutual.map((entity) => chip(entity)));
  fill("private", known.private.map(({ entity, seenBy }) => chip(entity, "only " + listed(seenBy))));
  byId("why").textContent = current.entity === null
    ? "Choose one of them to read why it is, or is not, common knowledge."
    : whyOf(current.group, known, current.entity);
}

function table(caption, rows) {
  const body = make("tbody");
  for (const { name, probability, taken } of rows)
    body.append(make("tr", { className: taken ? "taken" : "" }, make("td", { text: name }), make("td", { text: percent(probability) })));
  return make("table", {}, make("caption", { text: caption }), body);
}

function pairButton(pair) {
  const joint = 1 - pair.delegate;
  const isShown = current.group.length === 2 && pair.members.every((agent) => current.group.includes(agent));
  const says = pair.choice === "joint" ? `joint, ${percent(joint)}` : pair.choice === "delegate" ? `delegated, ${percent(pair.delegate)}` : `would act jointly ${percent(joint)}`;
  const meter = make("span", { className: "meter" }, make("i"));
  meter.firstChild.style.width = 100 * joint + "%";
  const button = make("button", { type: "button", className: "pair", data: { pair: pair.members.join(",") } },
    make("b", { text: listed(pair.members) }), meter, make("span", { className: "says", text: says }));
  button.setAttribute("aria-pressed", String(isShown));
  button.addEventListener("click", () => choose(pair.members));
  return button;
}

function takenJointly(pair, decision, actions) {
  return pair.choice === "joint" && pair.members.every((agent, place) => decision.actions[agent] === actions[place]);
}

function showDecision() {
  const decision = data.decisions[current.step], box = byId("decision");
  const focused = document.activeElement && box.contains(document.activeElement) ? document.activeElement.dataset.pair : undefined;
  box.replaceChildren();
  if (!decision) {
    box.append(make("h2", { text: "The end" }), make("p", { className: "facts", text: data.outcome }));
    return;
  }
  box.append(make("h2", { text: `Decision at step ${current.step}` }));
  if (decision.partitions.length > 0) showPartition(box, decision);
  for (const group of decision.groups) showGroup(box, group, decision);
  showTables(box, decision);
  if (decision.marginal !== null) box.append(make("p", { className: "facts",
    text: `Probability of the way taken ${small(decision.way)}; of the joint action over all ways, p(u) = ${small(decision.marginal)}.` }));
  if (focused !== undefined) { const again = box.querySelector(`[data-pair="${focused}"]`); if (again) again.focus(); }
}

function showPartition(box, decision) {
  const chosen = decision.partitions[decision.chosen];
  box.append(make("p", { className: "facts",
    text: `Partition in force: ${groupsName(chosen.groups)}, ${percent(chosen.probability)}; given what was done ${percent(chosen.posterior)}` }));
  for (const pair of decision.pairs) if (pair.choice) box.append(pairButton(pair));
  const others = decision.pairs.filter((pair) => !pair.choice && pair.known > 0);
  if (others.length > 0) {
    const details = make("details", { open: current.openOthers }, make("summary", { text: `${others.length} other pairs with common knowledge` }));
    const fill = () => { if (details.open && details.children.length === 1) details.append(...others.slice(0, 60).map(pairButton)); };
    details.addEventListener("toggle", () => { current.openOthers = details.open; fill(); });
    fill();
    box.append(details);
  }
  if (decision.partitions.length > 1) box.append(divisionTable("Partitions", decision.partitions, decision.chosen));
}

/** A group that divides further, if it was formed; or the whole team, where it acts as one. */
function showGroup(box, group, decision) {
  if (group.joint.length > 0)
    box.append(table(`Team ${listed(group.members)}`, group.joint.map(([actions, probability]) => ({
      name: actions.map((action, place) => actionName(group.members[place], action)).join(" + "), probability,
      taken: actions.every((action, place) => decision.actions[group.members[place]] === action) }))));
  else if (group.chosen !== null) box.append(divisionTable(`Group ${listed(group.members)}`, group.divisions, group.chosen));
}

function divisionTable(caption, divisions, chosen) {
  const rows = divisions.map((division, index) => ({ name: groupsName(division.groups), probability: division.probability, taken: index === chosen }));
  rows.sort((a, b) => b.probability - a.probability);
  return table(caption, rows.slice(0, 5));
}

const groupsName = (groups) => groups.map((group) => `{${group.map(nameOf).join(", ")}}`).join(" ");

function showTables(box, decision) {
  if (current.group.length === 2) {
    const pair = decision.pairs.find((pair) => pair.members.every((agent) => current.group.includes(agent)));
    if (pair) {
      const rows = [{ name: "delegate", probability: pair.delegate, taken: pair.choice === "delegate" }];
      for (const [first, second, probability] of pair.joint)
        rows.push({ name: `${actionName(pair.members[0], first)} + ${actionName(pair.members[1], second)}`, probability, taken: takenJointly(pair, decision, [first, second]) });
      box.append(table(`Pair ${listed(pair.members)}`, rows));
    }
  }
  for (const agent of current.group.slice(0, 4)) {
    const solo = decision.solo.find((solo) => solo.agent === agent);
    if (solo) box.append(table(`${nameOf(agent)} alone`, solo.options.map(([action, probability]) =>
      ({ name: actionName(agent, action), probability, taken: decision.actions[agent] === action }))));
    else if (isAlive(current.step, agent)) box.append(make("p", { className: "facts", text: `${nameOf(agent)}: ${actionName(agent, decision.actions[agent])}` }));
  }
}
