// What moves on the map: where the target may be, and the flights.
const targets = (() => {
  const T = D.targets, first = offsets(unpack(T.knots));
  const places = (text, from) => Float64Array.from(unpack(text), (n) => from + n * D.frame.m);
  const times = (text) => Float64Array.from(unpack(text), (n) => (n === 65535 ? Infinity : n * D.frame.s));
  return { first, t: times(T.t), x: places(T.x, D.frame.x), y: places(T.y, D.frame.y), seen: times(T.seen), gone: unpack(T.gone), size: T.size, kind: T.kind ? unpack(T.kind) : null };
})();
// How a target is told from others: corners, how far they are turned, and a colour.
const LOOKS = [[0, 0, "dot"], [4, 0, "c3"], [4, Math.PI / 4, "c4"], [3, Math.PI, "c2"]];
const kinds = targets.kind ? [...new Set(targets.kind)].sort() : [0];
function mark(x, y, size, kind) {
  const [corners, turn] = LOOKS[kind % LOOKS.length];
  if (!corners) {
    pen.moveTo(x + size, y);
    pen.arc(x, y, size, 0, 7);
    return;
  }
  const at = (i) => turn + (2 * Math.PI * i) / corners;
  line(pen, Array.from({ length: corners }, (_, i) => [x + 1.3 * size * Math.sin(at(i)), y - 1.3 * size * Math.cos(at(i))]));
  pen.closePath();
}

// The last row of those from a to z whose time is not later; times rise.
function lastBy(time, a, z, s) {
  while (z - a > 1) {
    const middle = (a + z) >> 1;
    if (time(middle) <= s) a = middle;
    else z = middle;
  }
  return a;
}
function targetAt(k, s) {
  const { first, t, x, y, gone } = targets, a = first[k], z = first[k + 1];
  if (a === z || t[a] > s) return null;
  const i = lastBy((n) => t[n], a, z, s);
  if (i + 1 === z) return gone[k] && s > t[i] ? null : [x[i], y[i]];
  const part = (s - t[i]) / (t[i + 1] - t[i]);
  return [x[i] + part * (x[i + 1] - x[i]), y[i] + part * (y[i + 1] - y[i])];
}
function drawTargets(s) {
  for (const isFree of [false, true]) for (const kind of kinds) drawKind(s, isFree, kind);
  pen.globalAlpha = 1;
}
function drawKind(s, isFree, kind) {
  const r = ratio() * (onPaper ? 1.2 : 1);
  pen.beginPath();
  for (let k = 0; k + 1 < targets.first.length; k++) {
    if (targets.seen[k] > s !== isFree || (targets.kind && targets.kind[k] !== kind)) continue;
    const place = targetAt(k, s);
    if (!place) continue;
    const size = (isFree ? 3 : 2) * r * (targets.size ? targets.size[k] : 1);
    mark(across(place[0]), down(place[1]), size, kind);
  }
  pen.globalAlpha = isFree ? 0.8 : 0.7;
  pen.fillStyle = colours[LOOKS[kind % LOOKS.length][2]];
  pen.strokeStyle = colours.seen;
  pen.lineWidth = r;
  if (isFree) pen.fill();
  else pen.stroke();
}

// Of a flight: where it is, and after which waypoint.
function droneAt(way, s) {
  if (s <= way[0][0]) return [way[0][1], way[0][2], 0];
  const i = lastBy((n) => way[n][0], 0, way.length, s), [a, b] = [way[i], way[i + 1]];
  if (!b) return [a[1], a[2], i];
  const part = b[0] > a[0] ? (s - a[0]) / (b[0] - a[0]) : 1;
  return [a[1] + part * (b[1] - a[1]), a[2] + part * (b[2] - a[2]), i];
}
function drawWay(points, width, opacity, dash) {
  const r = ratio();
  pen.lineWidth = width * r;
  pen.globalAlpha = opacity;
  pen.setLineDash(dash.map((n) => n * r));
  stroke(pen, placed(points));
  pen.setLineDash([]);
  pen.globalAlpha = 1;
}
function drawFlight(uav, s) {
  const way = uav.waypoints;
  if (!way.length) return;
  const here = droneAt(way, s), soon = droneAt(way, s + D.soon_s), at = (row) => [row[1], row[2]];
  pen.strokeStyle = pen.fillStyle = colours.uav;
  pen.lineCap = "butt";
  drawWay([soon, ...way.slice(soon[2] + 1).map(at)], 1.3, 0.55, []);
  if (s < way[way.length - 1][0]) drawWay([here, ...way.slice(here[2] + 1, soon[2] + 1).map(at), soon], 3, 1, [3, 3]);
  pen.lineCap = "round";
  if (s > way[0][0]) drawWay([...way.slice(0, here[2] + 1).map(at), here], 3, 1, []);
  drawDrone(here, uav.sensor_on.some(([from, to]) => from <= s && s <= to));
  if (!uav.name) return;
  pen.strokeStyle = colours.bg;
  pen.fillStyle = colours.fg;
  write(pen, 12, "left", "alphabetic");
  halo(pen, uav.name.replace("drone ", ""), across(here[0]) + 10 * ratio(), down(here[1]) - 4 * ratio());
}
// The sensor's disc is dashed while it is off; the drone is hollow at the edge while it is beyond.
function drawDrone(here, sees) {
  const r = ratio(), x = across(here[0]), y = down(here[1]), size = 8 * r;
  const px = clip(x, size, map.width - size), py = clip(y, size, map.height - size);
  pen.lineWidth = 1.5 * r;
  pen.beginPath();
  pen.arc(x, y, Math.max(D.radius_m * view.scale, 3 * r), 0, 7);
  pen.globalAlpha = 0.16;
  if (sees) pen.fill();
  pen.globalAlpha = 1;
  pen.setLineDash(sees ? [] : [4 * r, 4 * r]);
  pen.stroke();
  pen.setLineDash([]);
  pen.beginPath();
  line(pen, [[px, py - size], [px + 0.8 * size, py + 0.7 * size], [px - 0.8 * size, py + 0.7 * size]]);
  pen.closePath();
  pen.fillStyle = px === x && py === y ? colours.uav : colours.bg;
  pen.fill();
  pen.strokeStyle = px === x && py === y ? colours.bg : colours.uav;
  pen.stroke();
}
function drawPin([x, y, to]) {
  const r = ratio(), px = across(x), py = down(y);
  pen.strokeStyle = colours.acc;
  pen.lineWidth = 2.5 * r;
  pen.beginPath();
  pen.arc(px, py, 9 * r, 0, 7);
  for (const [dx, dy] of [[r, 0], [-r, 0], [0, r], [0, -r]]) line(pen, [5, 14].map((n) => [px + n * dx, py + n * dy]));
  if (to !== undefined) {
    const at = ((to + north) * Math.PI) / 180, end = (long, turn) => [px + long * r * Math.sin(at + turn), py - long * r * Math.cos(at + turn)];
    for (const from of [[px, py], end(44, -0.15), end(44, 0.15)]) line(pen, [from, end(56, 0)]);
  }
  pen.stroke();
}
function drawMap(s, pin) {
  sized(map);
  if (!ground) drawGround();
  pen.clearRect(0, 0, map.width, map.height);
  pen.drawImage(ground, 0, 0);
  drawTargets(s);
  for (const uav of D.uavs) drawFlight(uav, s);
  if (pin) drawPin(pin);
}
