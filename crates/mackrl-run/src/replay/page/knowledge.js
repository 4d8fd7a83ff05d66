// Who sees what, and what follows from it for a group (Lemma 1). Tests hold this equal to the library's rule.

const data = JSON.parse(document.getElementById("replay").textContent);
const viewCache = new Map();

/** Whether each agent sees each entity at a step: views[agent][entity]. */
function viewsAt(step) {
  let views = viewCache.get(step);
  if (!views) {
    views = data.frames[step].views.map((digits) => {
      const view = new Uint8Array(data.entities.length);
      for (let entity = 0; entity < view.length; entity++) {
        const digit = digits.length - 1 - (entity >> 2);
        view[entity] = digit < 0 ? 0 : (parseInt(digits[digit], 16) >> (entity & 3)) & 1;
      }
      return view;
    });
    if (viewCache.size > 400) viewCache.clear();
    viewCache.set(step, views);
  }
  return views;
}

const isAlive = (step, entity) => data.frames[step].life[entity] > 0;
const nameOf = (entity) => data.entities[entity].name;

/** What a group knows at a step. `common` is empty unless every member sees every member. */
function knowledgeOf(step, group) {
  const views = viewsAt(step);
  const unseen = [];
  for (const who of group) for (const whom of group) if (!views[who][whom]) unseen.push([who, whom]);
  const known = { common: [], mutual: [], private: [], unseen };
  for (let entity = 0; entity < data.entities.length; entity++) {
    const seenBy = group.filter((agent) => views[agent][entity]);
    if (seenBy.length === 0) continue;
    if (seenBy.length < group.length) known.private.push({ entity, seenBy });
    else (unseen.length === 0 ? known.common : known.mutual).push(entity);
  }
  return known;
}

const listed = (agents) => {
  const names = agents.map(nameOf);
  return names.length < 2 ? names.join("") : names.slice(0, -1).join(", ") + " and " + names[names.length - 1];
};
const verb = (agents, one, many) => (agents.length === 1 ? one : many);

/** One sentence: whether the group has common knowledge, and why. */
function verdictOf(group, known) {
  if (group.length === 0) return "No agent is chosen.";
  if (group.some((agent) => !isAlive(current.step, agent))) return "The dead know nothing, and nothing is common with them.";
  if (group.length === 1) return `${nameOf(group[0])} alone: all that it sees.`;
  if (known.unseen.length === 0) return group.length === 2
    ? `${nameOf(group[0])} sees ${nameOf(group[1])}, and ${nameOf(group[1])} sees ${nameOf(group[0])}: what both see is common knowledge.`
    : `${listed(group)} all see each other: what all see is common knowledge.`;
  const [who, whom] = known.unseen[0];
  const more = known.unseen.length > 1 ? ` (and ${known.unseen.length - 1} more)` : "";
  return `Nothing is common knowledge: ${nameOf(who)} does not see ${nameOf(whom)}${more}.`;
}

/** Why an entity is or is not common knowledge of the group. */
function whyOf(group, known, entity) {
  const name = nameOf(entity);
  const views = viewsAt(current.step);
  const others = group.filter((agent) => agent !== entity);
  const seers = others.filter((agent) => views[agent][entity]);
  const blind = others.filter((agent) => !views[agent][entity]);
  if (group.length === 0) return "";
  if (blind.length > 0) {
    const sees = seers.length > 0 ? `${listed(seers)} ${verb(seers, "sees", "see")} ${name}; ` : "";
    return `${sees}${listed(blind)} ${verb(blind, "does", "do")} not see ${name}.`;
  }
  const chain = [];
  for (const who of group) for (const whom of group) if (who < whom && views[who][whom] && views[whom][who]) chain.push(`${nameOf(who)} and ${nameOf(whom)} see each other`);
  const all = others.length > 1 ? "all of them see" : `${listed(others)} sees`;
  if (known.unseen.length === 0) {
    const base = chain.length === 0 ? "" : chain.length <= 3 ? chain.join(", ") + ", and " : "All members see each other, and ";
    return `${base}${others.length === 0 ? name + " knows of itself" : all + " " + name}. So each of them knows it, knows that each of them knows it, and so on.`;
  }
  const [who, whom] = known.unseen[0];
  return `Every member sees ${name}, but ${nameOf(who)} does not see ${nameOf(whom)}: ${nameOf(who)} cannot tell whether ${nameOf(whom)} sees ${name}, so the group cannot rely on it.`;
}
