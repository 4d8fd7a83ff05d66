// The battle on a canvas. Positions between two steps are interpolated while it plays.

const canvas = document.getElementById("battle");
const pen = canvas.getContext("2d");
const still = window.matchMedia("(prefers-reduced-motion: reduce)");
let colours = {};
let scale = { unit: 1, fit: 1, left: 0, top: 0, width: 0, height: 0 };

function readColours() {
  const style = getComputedStyle(document.documentElement);
  for (const name of ["ground", "wall", "grid", "ally", "enemy", "common", "mutual", "private", "life", "shield", "bar", "ink", "faint", "card"])
    colours[name] = style.getPropertyValue("--" + name).trim();
}

/** The ground about everywhere that a unit ever is: [west, south, east, north]. */
const ground = (() => {
  let [west, south, east, north] = [Infinity, Infinity, -Infinity, -Infinity];
  for (const frame of data.frames) for (let i = 0; i < frame.x.length; i++) {
    west = Math.min(west, frame.x[i]); east = Math.max(east, frame.x[i]);
    south = Math.min(south, frame.y[i]); north = Math.max(north, frame.y[i]);
  }
  const widen = (low, high, least) => {
    const middle = (low + high) / 2, half = Math.max(high - low + 4, least) / 2;
    const first = Math.max(0, Math.min(middle - half, data.edge - 2 * half));
    return [first, Math.min(data.edge, first + 2 * half)];
  };
  [west, east] = widen(west, east, 13);
  [south, north] = widen(south, north, 7);
  return { west, south, east, north };
})();

function resize() {
  const width = canvas.parentElement.clientWidth;
  const unit = Math.min(width / (ground.east - ground.west), Math.max(300, 0.62 * window.innerHeight) / (ground.north - ground.south));
  const height = Math.ceil(unit * (ground.north - ground.south));
  const dots = Math.min(window.devicePixelRatio || 1, 2);
  canvas.width = Math.round(width * dots);
  canvas.height = Math.round(height * dots);
  canvas.style.height = height + "px";
  const left = (width - unit * (ground.east - ground.west)) / 2;
  scale = { unit, fit: unit, left, top: 0, width, height, dots };
}

const toX = (x) => scale.left + (x - ground.west) * scale.unit;
const toY = (y) => scale.top + (ground.north - y) * scale.unit;

/** Enlarges the picture about a point of the canvas; at its least size all of the battle is seen. */
function zoomAt(x, y, factor) {
  const unit = Math.min(8 * scale.fit, scale.unit * factor);
  if (unit <= scale.fit) resize();
  else scale = { ...scale, unit, left: x - (x - scale.left) * unit / scale.unit, top: y - (y - scale.top) * unit / scale.unit };
}

function shiftBy(right, down) {
  if (scale.unit > scale.fit) scale = { ...scale, left: scale.left + right, top: scale.top + down };
}

/** Where an entity is at a moment between two steps. */
function placeOf(entity, time) {
  const step = Math.floor(time), part = time - step;
  const now = data.frames[step], next = data.frames[Math.min(step + 1, data.frames.length - 1)];
  const mix = (a, b) => a + (b - a) * part;
  return [toX(mix(now.x[entity], next.x[entity])), toY(mix(now.y[entity], next.y[entity]))];
}

function circle(x, y, radius) { pen.beginPath(); pen.arc(x, y, radius, 0, 2 * Math.PI); }

function diamond(x, y, radius) {
  const reach = 1.2533 * radius;
  pen.beginPath();
  pen.moveTo(x, y - reach); pen.lineTo(x + reach, y); pen.lineTo(x, y + reach); pen.lineTo(x - reach, y); pen.closePath();
}

function drawGround() {
  pen.fillStyle = colours.wall;
  pen.fillRect(0, 0, scale.width, scale.height);
  pen.fillStyle = colours.ground;
  for (let y = 0; y < data.edge; y++) {
    for (let x = 0; x < data.edge; x++) {
      if (data.walkable[y][x] !== "1") continue;
      let end = x;
      while (end < data.edge - 1 && data.walkable[y][end + 1] === "1") end++;
      pen.fillRect(toX(x), toY(y + 1), toX(end + 1) - toX(x) + 0.5, scale.unit + 0.5);
      x = end;
    }
  }
  pen.strokeStyle = colours.grid;
  pen.lineWidth = 1;
  pen.beginPath();
  for (let place = 0; place <= data.edge; place += 4) {
    pen.moveTo(toX(place), 0); pen.lineTo(toX(place), scale.height);
    pen.moveTo(0, toY(place)); pen.lineTo(scale.width, toY(place));
  }
  pen.stroke();
}

function drawFields(time) {
  const step = Math.floor(time);
  for (let agent = 0; agent < data.agents; agent++) {
    const inGroup = current.group.includes(agent);
    if (!isAlive(step, agent) || current.fields === "none" || (current.fields === "group" && !inGroup)) continue;
    const [x, y] = placeOf(agent, time);
    circle(x, y, data.sight * scale.unit);
    pen.fillStyle = inGroup ? colours.ally : colours.faint;
    pen.globalAlpha = inGroup ? 0.1 : 0.04;
    pen.fill();
    pen.globalAlpha = inGroup ? 0.9 : 0.5;
    pen.strokeStyle = inGroup ? colours.ally : colours.faint;
    pen.lineWidth = inGroup ? 1.6 : 1;
    pen.setLineDash(inGroup ? [] : [6, 5]);
    pen.stroke();
    pen.setLineDash([]);
    pen.globalAlpha = 1;
  }
}

function line(from, to) { pen.beginPath(); pen.moveTo(...from); pen.lineTo(...to); pen.stroke(); }

/** The pairs of the partition in force: bands from body to body, over the bodies so that a melee hides none. */
function drawLinks(time) {
  const decision = data.decisions[Math.floor(time)];
  if (!decision) return;
  for (const pair of decision.pairs) {
    if (!pair.choice) continue;
    const centres = pair.members.map((agent) => placeOf(agent, time));
    const length = Math.hypot(centres[1][0] - centres[0][0], centres[1][1] - centres[0][1]) || 1;
    const trimmed = (end) => {
      const part = Math.min(0.4, 0.62 * data.entities[pair.members[end]].radius * scale.unit / length);
      return [0, 1].map((axis) => centres[end][axis] + part * (centres[1 - end][axis] - centres[end][axis]));
    };
    const [from, to] = [trimmed(0), trimmed(1)];
    pen.strokeStyle = colours.card; pen.lineWidth = 9; line(from, to);
    if (pair.choice === "joint") {
      pen.strokeStyle = colours.common; pen.lineWidth = 7; line(from, to);
      pen.strokeStyle = colours.card; pen.lineWidth = 2.2; line(from, to);
    } else {
      pen.strokeStyle = colours.private; pen.lineWidth = 4; pen.setLineDash([6, 4]); line(from, to); pen.setLineDash([]);
    }
  }
}

/** What the decision at this time makes of it: who attacks or aims at whom in the step that follows. */
function drawShots(time) {
  const frame = data.frames[Math.floor(time) + 1];
  if (!frame) return;
  for (const [from, to, fired] of frame.shots) {
    const [start, end] = [placeOf(from, time), placeOf(to, time)];
    const length = Math.hypot(end[0] - start[0], end[1] - start[1]);
    const near = (data.entities[from].radius + data.entities[to].radius) * scale.unit;
    if (length <= near + 1) continue;
    const along = (distance) => [0, 1].map((axis) => start[axis] + (end[axis] - start[axis]) * distance / length);
    const tip = along(length - data.entities[to].radius * scale.unit - 2);
    pen.strokeStyle = pen.fillStyle = from < data.agents ? colours.ally : colours.enemy;
    pen.lineWidth = fired ? 1.8 : 1;
    pen.setLineDash(fired ? [] : [3, 4]);
    line(along(data.entities[from].radius * scale.unit), tip);
    pen.setLineDash([]);
    if (!fired) continue;
    const back = along(length - data.entities[to].radius * scale.unit - 10);
    const side = [-(end[1] - start[1]) / length * 3.6, (end[0] - start[0]) / length * 3.6];
    pen.beginPath();
    pen.moveTo(...tip); pen.lineTo(back[0] + side[0], back[1] + side[1]); pen.lineTo(back[0] - side[0], back[1] - side[1]);
    pen.fill();
  }
}

/** A ring about everything that the group knows: double, dashed or dotted. */
function drawRings(time) {
  const known = current.known;
  const ring = (entity, distance, colour, width, dashes) => {
    const [x, y] = placeOf(entity, time);
    const reach = entity < data.agents ? 1 : 1.25;
    circle(x, y, reach * data.entities[entity].radius * scale.unit + distance);
    pen.strokeStyle = colour; pen.lineWidth = width; pen.setLineDash(dashes); pen.stroke(); pen.setLineDash([]);
  };
  for (const entity of known.common) {
    const [x, y] = placeOf(entity, time);
    circle(x, y, (entity < data.agents ? 1 : 1.25) * data.entities[entity].radius * scale.unit + 7);
    pen.fillStyle = colours.common; pen.globalAlpha = 0.25; pen.fill(); pen.globalAlpha = 1;
    ring(entity, 7, colours.common, 2.2, []); ring(entity, 3.5, colours.common, 1.1, []);
  }
  for (const entity of known.mutual) ring(entity, 6, colours.mutual, 2.4, [7, 4]);
  for (const { entity } of known.private) ring(entity, 6, colours.private, 2.4, [2, 3.5]);
}

function drawBody(entity, time) {
  const frame = data.frames[Math.floor(time)], unit = data.entities[entity];
  const [x, y] = placeOf(entity, time), radius = Math.max(unit.radius * scale.unit, 5);
  const outline = entity < data.agents ? circle : diamond;
  outline(x, y, radius + 1.5);
  pen.fillStyle = colours.card; pen.fill();
  outline(x, y, radius);
  pen.fillStyle = entity < data.agents ? colours.ally : colours.enemy; pen.fill();
  if (entity === current.entity) { outline(x, y, radius + 2); pen.strokeStyle = colours.ink; pen.lineWidth = 2; pen.stroke(); }
  const size = Math.max(8, Math.min(20, 1.05 * radius)) * (unit.letters.length > 1 ? 0.8 : 1);
  pen.fillStyle = "#fff"; pen.font = `600 ${size}px system-ui, sans-serif`; pen.textAlign = "center";
  pen.fillText(unit.letters, x, y + 0.36 * size - 0.28 * radius);
  const width = 1.5 * radius, height = Math.max(0.2 * radius, 2);
  const bar = (top, share, colour) => {
    pen.fillStyle = colours.card; pen.fillRect(x - width / 2 - 1, top - 1, width + 2, height + 2);
    pen.fillStyle = colours.bar; pen.fillRect(x - width / 2, top, width, height);
    pen.fillStyle = colour; pen.fillRect(x - width / 2, top, width * share, height);
  };
  bar(y + 0.2 * radius, frame.life[entity], colours.life);
  if (unit.shield) bar(y + 0.2 * radius + height + 1, frame.shield[entity], colours.shield);
  drawCooldown(x, y, radius, frame.cooldown[entity]);
}

/** The part of the weapon's period that is left, as an arc about the body. */
function drawCooldown(x, y, radius, share) {
  if (share <= 0.01) return;
  pen.beginPath();
  pen.arc(x, y, radius + 2, -Math.PI / 2, -Math.PI / 2 + 2 * Math.PI * Math.min(share, 1));
  pen.strokeStyle = colours.faint; pen.lineWidth = 1.6; pen.stroke();
}

const names = { font: "600 11.5px system-ui, sans-serif", half: 6.5, distances: [2, 9, 18], directions: [14, 10, 2, 6, 0, 8, 12, 4] };

/** Each name in the first place beside its unit that is clear of all bodies and of the names before it; left out if there is none. */
function drawNames(time) {
  const bodies = [], taken = [];
  data.entities.forEach((unit, entity) => {
    if (!isAlive(Math.floor(time), entity)) return;
    const [x, y] = placeOf(entity, time), radius = Math.max(unit.radius * scale.unit, 5);
    bodies.push({ entity, x, y, radius, tip: 1.2533 * radius });
  });
  const covers = ({ entity, x, y, radius, tip }, [left, top, right, bottom]) => {
    const aside = Math.max(left - x, x - right, 0), above = Math.max(top - y, y - bottom, 0);
    return entity < data.agents ? Math.hypot(aside, above) < radius : aside + above < tip;
  };
  const overlap = (a, b) => a[0] < b[2] && b[0] < a[2] && a[1] < b[3] && b[1] < a[3];
  pen.font = names.font; pen.textAlign = "center";
  for (const body of bodies) {
    const name = nameOf(body.entity), half = pen.measureText(name).width / 2 + 1.5;
    const plates = names.distances.flatMap((distance) => names.directions.map((direction) => {
      const turn = direction * Math.PI / 8, [east, south] = [Math.cos(turn), Math.sin(turn)];
      const edge = body.entity < data.agents ? body.radius : body.tip / (Math.abs(east) + Math.abs(south));
      const beside = (along) => Math.max(-1, Math.min(1, 1.5 * along));
      const x = body.x + east * (edge + distance) + beside(east) * half, y = body.y + south * (edge + distance) + beside(south) * names.half;
      return [x - half, y - names.half, x + half, y + names.half];
    }));
    const plate = plates.find((plate) => !bodies.some((other) => covers(other, plate)) && !taken.some((other) => overlap(other, plate)));
    if (!plate) continue;
    taken.push(plate);
    pen.fillStyle = colours.card; pen.globalAlpha = 0.75;
    pen.fillRect(plate[0], plate[1], 2 * half, 2 * names.half);
    pen.globalAlpha = 1; pen.fillStyle = colours.ink;
    pen.fillText(name, plate[0] + half, plate[3] - 2.5);
  }
}

function drawFallen(entity, time) {
  const [x, y] = placeOf(entity, time), arm = 0.28 * scale.unit;
  pen.strokeStyle = colours.faint; pen.lineWidth = 2; pen.globalAlpha = 0.6;
  line([x - arm, y - arm], [x + arm, y + arm]); line([x - arm, y + arm], [x + arm, y - arm]);
  pen.globalAlpha = 1;
}

function draw(time) {
  const step = Math.floor(time);
  pen.setTransform(scale.dots, 0, 0, scale.dots, 0, 0);
  drawGround();
  drawFields(time);
  data.entities.forEach((_, entity) => { if (!isAlive(step, entity)) drawFallen(entity, time); });
  drawRings(time);
  drawShots(time);
  data.entities.forEach((_, entity) => { if (isAlive(step, entity)) drawBody(entity, time); });
  drawLinks(time);
  drawNames(time);
  pen.fillStyle = colours.ink;
  for (const [x, y] of data.frames[step].missiles) { circle(toX(x), toY(y), 2.6); pen.fill(); }
}

/** The living entity under a point of the canvas, or the pair whose link is there. */
function hit(x, y) {
  let best = { distance: 14 };
  data.entities.forEach((unit, entity) => {
    if (!isAlive(current.step, entity)) return;
    const [at, down] = placeOf(entity, current.step);
    const distance = Math.hypot(at - x, down - y) - unit.radius * scale.unit;
    if (distance < best.distance) best = { distance, entity };
  });
  if (best.entity !== undefined) return best;
  const decision = data.decisions[current.step];
  for (const pair of decision ? decision.pairs : []) {
    if (!pair.choice) continue;
    const [from, to] = pair.members.map((agent) => placeOf(agent, current.step));
    const along = [to[0] - from[0], to[1] - from[1]], length = Math.hypot(...along) || 1;
    const part = Math.max(0, Math.min(1, ((x - from[0]) * along[0] + (y - from[1]) * along[1]) / length ** 2));
    if (Math.hypot(from[0] + part * along[0] - x, from[1] + part * along[1] - y) < 8) return { pair };
  }
  return {};
}
