// The map: what of the plane it shows, and all that does not move on it.
const map = $("map"), pen = map.getContext("2d");
const FONT = "system-ui,-apple-system,'Segoe UI',Roboto,'DejaVu Sans',sans-serif";
const PAPER = { width: 1900, height: 1270, curve: 480 };
// True north, degrees from the net's.
const north = D.earth ? D.earth.north : 0;
let view = null, ground = null, isWhole = true, onPaper = false, gridShown = false, colours = {};

const ratio = () => (onPaper ? 3 : window.devicePixelRatio || 1);
function readColours() {
  const style = getComputedStyle(document.documentElement);
  for (const name of ["bg", "fg", "dim", "line", "road", "dot", "seen", "uav", "bad", "acc", "c1", "c2", "c3", "c4", "c5"])
    colours[name] = style.getPropertyValue("--" + name).trim();
}
function sized(canvas) {
  const width = onPaper ? PAPER.width : Math.round(canvas.clientWidth * ratio());
  const height = onPaper ? (canvas === map ? PAPER.height : PAPER.curve) : Math.round(canvas.clientHeight * ratio());
  if (canvas.width === width && canvas.height === height) return;
  canvas.width = width;
  canvas.height = height;
  if (canvas === map) {
    if (isWhole) fit();
    ground = null;
  }
}
function fit() {
  const [west, south, east, north] = D.view;
  // Room for the scale above and the legend below.
  const top = 34 * ratio(), bottom = onPaper ? 0 : $("legend").offsetHeight * ratio();
  const scale = Math.min(map.width / (east - west), (map.height - top - bottom) / (north - south));
  view = { scale, x: (west + east) / 2, y: (south + north) / 2 + (top - bottom) / 2 / scale };
  isWhole = true;
  ground = null;
}
const across = (x) => (x - view.x) * view.scale + map.width / 2;
const down = (y) => map.height / 2 - (y - view.y) * view.scale;
const eastOf = (px) => (px - map.width / 2) / view.scale + view.x;
const northOf = (px) => view.y - (px - map.height / 2) / view.scale;
// About a pixel, which stays where it is.
function zoom(by, px = map.width / 2, py = map.height / 2) {
  view.scale *= by;
  move((px - map.width / 2) * (1 - by), (py - map.height / 2) * (1 - by));
}
function move(px, py) {
  view.x -= px / view.scale;
  view.y += py / view.scale;
  isWhole = false;
  ground = null;
}

const roads = (() => {
  const xy = unpack(D.roads.xy);
  return { first: offsets(unpack(D.roads.points)), xy: Float64Array.from(xy, (n, i) => (i % 2 ? D.frame.y : D.frame.x) + n * D.frame.m) };
})();
// A line, in pixels or in metres; and how text is written.
function line(c, points) {
  points.forEach(([x, y], i) => (i ? c.lineTo(x, y) : c.moveTo(x, y)));
}
const placed = (points) => points.map(([x, y]) => [across(x), down(y)]);
function stroke(c, points) {
  c.beginPath();
  line(c, points);
  c.stroke();
}
function write(c, size, align, base) {
  c.font = size * ratio() + "px " + FONT;
  c.textAlign = align;
  c.textBaseline = base;
}
function drawRoads(c) {
  c.strokeStyle = colours.road;
  c.lineWidth = clip(5 * view.scale, ratio(), 7 * ratio());
  c.beginPath();
  for (let k = 0; k + 1 < roads.first.length; k++)
    for (let i = roads.first[k]; i < roads.first[k + 1]; i++) {
      const x = across(roads.xy[2 * i]), y = down(roads.xy[2 * i + 1]);
      if (i > roads.first[k]) c.lineTo(x, y);
      else c.moveTo(x, y);
    }
  c.stroke();
}
function drawAreas(c) {
  const looks = { no_fly: [colours.bad, []], fence: [colours.bad, [9, 5]], within: [colours.dim, [3, 4]] };
  for (const [kind, rings] of Object.entries(D.areas)) {
    c.strokeStyle = c.fillStyle = looks[kind][0];
    c.lineWidth = 2 * ratio();
    c.setLineDash(looks[kind][1].map((n) => n * ratio()));
    c.beginPath();
    for (const ring of rings) line(c, placed(ring));
    c.stroke();
    c.globalAlpha = 0.14;
    if (kind === "no_fly") c.fill("evenodd");
    c.globalAlpha = 1;
  }
  c.setLineDash([]);
}
// Names of streets, the longest first, wherever none is yet.
function drawNames(c) {
  const taken = [], r = ratio();
  write(c, 11, "center", "middle");
  c.fillStyle = colours.dim;
  for (const [name, x, y, angle] of D.labels) {
    const px = across(x), py = down(y), turn = (-angle * Math.PI) / 180;
    if (px < 0 || py < 0 || px > map.width || py > map.height) continue;
    const half = c.measureText(name).width / 2, wide = Math.abs(half * Math.cos(turn)) + 8 * r, high = Math.abs(half * Math.sin(turn)) + 8 * r;
    if (taken.length > 40 || taken.some((t) => Math.abs(t[0] - px) < t[2] + wide && Math.abs(t[1] - py) < t[3] + high)) continue;
    taken.push([px, py, wide, high]);
    c.save();
    c.translate(px, py);
    c.rotate(turn);
    halo(c, name, 0, 0);
    c.restore();
  }
}
function drawGrid(c) {
  const grid = D.earth && D.earth.grid, r = ratio();
  if (!grid) return;
  const floor = map.height - (onPaper ? 0 : $("legend").offsetHeight + 10) * r;
  c.strokeStyle = colours.acc;
  c.fillStyle = colours.fg;
  c.lineWidth = 0.6 * r;
  write(c, 10, "left", "alphabetic");
  for (const { xy, axis, km } of grid.lines) {
    const on = placed(xy), edge = axis ? 4 * r : floor - 24 * r;
    stroke(c, on);
    const at = on.map(([x, y]) => (axis ? [x, y] : [y, x]));
    for (let i = 1; i < at.length; i++) {
      const [a, b] = [at[i - 1], at[i]];
      if ((a[0] - edge) * (b[0] - edge) > 0 || a[0] === b[0]) continue;
      const there = a[1] + ((edge - a[0]) / (b[0] - a[0])) * (b[1] - a[1]);
      halo(c, km, axis ? edge : there + 3 * r, axis ? there - 3 * r : edge);
    }
  }
  c.textAlign = "right";
  const said = `UTM ${grid.zone}, MGRS ${grid.zone} ${grid.squares}, WGS 84; a line every ${metres(grid.step_m)}, in km`;
  const wide = c.measureText(said).width + 12 * r;
  c.fillStyle = colours.bg;
  c.fillRect(map.width - wide, floor - 18 * r, wide, 18 * r);
  c.fillStyle = colours.fg;
  c.fillText(said, map.width - 6 * r, floor - 6 * r);
}
function halo(c, text, x, y) {
  c.save();
  c.strokeStyle = colours.bg;
  c.lineWidth = 3 * ratio();
  c.strokeText(text, x, y);
  c.restore();
  c.fillText(text, x, y);
}
const metres = (m) => (m >= 1000 ? m / 1000 + " km" : m + " m");
function drawScale(c) {
  const r = ratio(), m = rounded((110 * r) / view.scale), long = m * view.scale, x = 14 * r, y = 16 * r;
  c.strokeStyle = c.fillStyle = colours.fg;
  c.lineWidth = 2 * r;
  stroke(c, [[x, y - 4 * r], [x, y], [x + long, y], [x + long, y - 4 * r]]);
  write(c, 12, "left", "alphabetic");
  halo(c, metres(m), x, y + 15 * r);
  c.save();
  c.translate(x + long + 26 * r, y + 6 * r);
  c.rotate((north * Math.PI) / 180);
  c.beginPath();
  line(c, [[0, -14 * r], [5 * r, 2 * r], [0, -r], [-5 * r, 2 * r]]);
  c.fill();
  c.textAlign = "center";
  halo(c, D.earth ? "N" : "y", 0, 15 * r);
  c.restore();
}
function drawGround() {
  ground = document.createElement("canvas");
  ground.width = map.width;
  ground.height = map.height;
  const c = ground.getContext("2d");
  c.lineCap = c.lineJoin = "round";
  drawRoads(c);
  drawAreas(c);
  drawNames(c);
  if (onPaper || gridShown) drawGrid(c);
  drawScale(c);
}

// Latitude and longitude, by polynomials that were fitted to the net's own projection; without
// one, metres.
function words(x, y) {
  if (!D.earth) return x.toFixed(1) + "," + y.toFixed(1);
  const e = D.earth, u = (x - e.middle[0]) / e.half, v = (y - e.middle[1]) / e.half;
  let k = 0, lat = 0, lon = 0;
  for (let i = 0; i <= 3; i++)
    for (let j = 0; i + j <= 3; j++, k++) {
      const term = u ** i * v ** j;
      lat += e.lat[k] * term;
      lon += e.lon[k] * term;
    }
  return lat.toFixed(5) + "," + lon.toFixed(5);
}
