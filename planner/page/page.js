// The page: one time for map, curves and table, and all that changes it.
const SPEEDS = [1, 10, 30, 60, 120, 300, 600];
let now = D.start_s, playing = false, following = false, last = 0, pin = null;
let speed = SPEEDS.find((n) => D.end_s / n <= 45) || 600;
document.documentElement.classList.add("on");
$("time").max = Math.ceil(D.end_s);

const tables = [...document.querySelectorAll(".legs")].map((table, u) => {
  const body = table.tBodies[0], rows = [...body.rows];
  const buttons = rows.map((row, i) => {
    const cell = row.cells[0], start = D.uavs[u].legs[i][1];
    const button = document.createElement("button");
    button.textContent = cell.textContent;
    button.tabIndex = i ? -1 : 0;
    aria(button, "label", "Go to leg " + cell.textContent);
    cell.replaceChildren(button);
    listen(row, "click", () => go(start));
    return button;
  });
  // One stop for Tab; arrows, Home and End go from leg to leg within it.
  listen(body, "focusin", (event) => buttons.forEach((button) => (button.tabIndex = button === event.target ? 0 : -1)));
  listen(body, "keydown", (event) => {
    const at = buttons.indexOf(event.target), last = buttons.length - 1;
    const to = { ArrowUp: at - 1, ArrowDown: at + 1, Home: 0, End: last }[event.key];
    if (to === undefined) return;
    event.preventDefault();
    event.stopPropagation();
    buttons[clip(to, 0, last)].focus();
  });
  return rows;
});
const legAt = (legs) => legs.findIndex((leg) => now < leg[2]);

// What each drone does, and does next; which one, where there are several.
const doings = D.uavs.map(() => {
  const line = add($("doing"), "p", "");
  return [add(line, "b", ""), add(line, "span", "")];
});
const startOf = ({ waypoints }) => (waypoints.length ? waypoints[0][0] : D.start_s);
function doing(uav) {
  const { legs, waypoints } = uav, i = legAt(legs), start = startOf(uav), who = uav.name ? uav.name + ": " : "";
  if (now < start) return [who + "on the ground", "takes off " + clock(start)];
  if (i < 0) return [who + (waypoints.length && now < waypoints.at(-1)[0] ? "flying" : "landed"), ""];
  const next = now < legs[i][1] ? "on the way there" : legs[i + 1] ? "then " + legs[i + 1][0] : "the last leg";
  return [who + (i + 1) + " " + legs[i][0], next];
}
function tell() {
  const share = odds(found(D.curves[0] || [0], now)), did = D.uavs.map(doing);
  $("clock").textContent = clock(now);
  $("since").textContent = D.clock ? span(now) + " after the sighting" : "after the sighting";
  $("found").textContent = share;
  doings.forEach((line, u) => line.forEach((part, k) => (part.textContent = did[u][k])));
  tables.forEach((rows, u) => {
    const here = now < startOf(D.uavs[u]) ? -1 : legAt(D.uavs[u].legs);
    rows.forEach((row, k) => {
      row.className = k === here ? "here" : D.uavs[u].legs[k][2] <= now ? "over" : "";
      if (k === here) aria(row, "current", "step");
      else row.removeAttribute("aria-current");
    });
  });
  const text = [clock(now), ...(D.curves.length ? [share + " found"] : []), ...did.map(([what]) => what)].join(", ");
  $("time").value = Math.round(now);
  aria($("time"), "valuetext", text);
  if (!playing && !following && $("state").textContent !== text) $("state").textContent = text;
  aria($("live"), "pressed", following);
}
function show() {
  drawMap(now, pin);
  drawCurves(now);
  tell();
}
function set(s) {
  now = clip(s, 0, D.end_s);
  show();
}
function go(s) {
  following = false;
  set(s);
}

// Playing, and following the clock on the wall.
function tick(ms) {
  if (following) set((Date.now() - D.clock.sighted_ms) / 1000);
  else if (playing) {
    set(now + (last ? ((ms - last) / 1000) * speed : 0));
    if (now >= D.end_s) play(false);
  } else return;
  last = ms;
  requestAnimationFrame(tick);
}
function play(on) {
  playing = on;
  $("play").textContent = on ? "\u2016" : "\u25b6";
  aria($("play"), "label", on ? "Pause" : "Play");
  if (!on) return tell();
  following = false;
  last = 0;
  if (now >= D.end_s) now = 0;
  requestAnimationFrame(tick);
}
function follow() {
  play(false);
  following = true;
  requestAnimationFrame(tick);
}
function quicken(by) {
  const n = SPEEDS.length, i = SPEEDS.indexOf(speed) + by;
  speed = SPEEDS[by ? clip(i, 0, n - 1) : (i + 1) % n];
  $("speed").textContent = speed + "\u00d7";
  aria($("speed"), "label", "Speed: " + speed + " times; press for another");
}
quicken(-1);
quicken(1);
function nextLeg(way) {
  const starts = D.uavs.flatMap((uav) => uav.legs.map((leg) => leg[1])).sort((a, b) => a - b);
  const found = way > 0 ? starts.find((s) => s > now + 0.5) : starts.filter((s) => s < now - 0.5).pop();
  if (found !== undefined) go(found);
}

// A place of the map: its coordinates, and the command that plans for a sighting there.
function call(x, y, to) {
  pin = [x, y, to];
  const heading = to === undefined ? "" : String(Math.round(to + 360) % 360);
  $("commands").replaceChildren();
  const place = words(x, y);
  $("place").textContent = place.replace(",", ", ") + (D.earth ? "" : " m");
  document.dispatchEvent(new CustomEvent("pin", { detail: { place, heading } }));
  $("why").textContent = D.call ? "Seen here " + (D.clock ? "at " + clock(now) : "now") + "? Drag from here which way it drove. This plans anew:" : "";
  if (D.call) {
    const here = new Date(), at = D.clock ? moment(now).slice(0, 19) + zone() : pad(here.getHours()) + ":" + pad(here.getMinutes());
    const { sh, PowerShell } = D.call, both = sh === PowerShell;
    for (const [shell, net] of both ? [["sh, PowerShell", sh]] : [["sh", sh], ["PowerShell", PowerShell]]) {
      add($("commands"), "span", shell);
      const line = add($("commands"), "code", "");
      line.tabIndex = 0;
      for (const word of ["planner now", net, `--last-seen=${place}`, `--at=${at}`, ...(heading && ["--heading=" + heading]), ...D.call.rest]) {
        add(line, "span", word);
        line.append(" ");
      }
      line.lastChild.remove();
    }
  }
  $("call").hidden = false;
  show();
}
function hang() {
  pin = null;
  $("call").hidden = true;
  show();
}

// Buttons, keys, wheel, fingers.
const clicks = {
  play: () => play(!playing), speed: () => quicken(0), close: hang,
  in: () => zoom(1.5), out: () => zoom(1 / 1.5), fit,
};
for (const [id, act] of Object.entries(clicks))
  listen($(id), "click", () => {
    act();
    show();
  });
if (D.clock) listen($("live"), "click", follow);
else $("live").hidden = true;
listen($("time"), "input", (event) => go(+event.target.value));
const SHIFT = 60;
const keys = {
  " ": () => play(!playing), Home: () => go(0), End: () => go(D.end_s),
  n: () => nextLeg(1), p: () => nextLeg(-1), "[": () => quicken(-1), "]": () => quicken(1),
  "+": () => zoom(1.4), "=": () => zoom(1.4), "-": () => zoom(1 / 1.4), 0: fit,
  w: () => move(0, SHIFT * ratio()), s: () => move(0, -SHIFT * ratio()), a: () => move(SHIFT * ratio(), 0), d: () => move(-SHIFT * ratio(), 0),
  g: () => { gridShown = !gridShown; ground = null; }, Escape: hang,
};
listen(document, "keydown", (event) => {
  if (event.ctrlKey || event.metaKey || event.altKey || event.target.closest("form")) return;
  const key = event.key, on = event.target.tagName;
  if (key === " " && (on === "BUTTON" || on === "SUMMARY")) return;
  if (key === "Enter" && event.target === map) call(view.x, view.y);
  else if (key === "ArrowLeft" || key === "ArrowRight") go(now + (key === "ArrowRight" ? 1 : -1) * (event.shiftKey ? 60 : 10));
  else if (keys[key]) keys[key]();
  else return;
  event.preventDefault();
  show();
});
const onCanvas = (event) => [event.offsetX * ratio(), event.offsetY * ratio()];
listen(map, "wheel", (event) => {
  event.preventDefault();
  zoom(Math.exp(-event.deltaY / 400), ...onCanvas(event));
  show();
}, { passive: false });
const fingers = new Map();
let moved = 0, turning = false; // turning: from the pin on, which way it went
const fromPin = ([px, py]) => [px - across(pin[0]), py - down(pin[1])];
listen(map, "pointerdown", (event) => {
  map.setPointerCapture(event.pointerId);
  if (!fingers.size) moved = 0;
  turning = pin && !fingers.size && Math.hypot(...fromPin(onCanvas(event))) < 24 * ratio();
  fingers.set(event.pointerId, onCanvas(event));
});
listen(map, "pointermove", (event) => {
  if (!fingers.has(event.pointerId)) return;
  const was = [...fingers.values()];
  fingers.set(event.pointerId, onCanvas(event));
  const is = [...fingers.values()], mean = (of, axis) => of.reduce((sum, p) => sum + p[axis], 0) / of.length;
  const dx = mean(is, 0) - mean(was, 0), dy = mean(is, 1) - mean(was, 1);
  moved += Math.hypot(dx, dy);
  if (is.length === 1 && moved < 6 * ratio()) return;
  if (turning) {
    const [px, py] = fromPin(is[0]);
    return call(pin[0], pin[1], (Math.atan2(px, -py) * 180) / Math.PI - north);
  }
  move(dx, dy);
  if (is.length === 2) {
    const apart = (of) => Math.max(Math.hypot(of[0][0] - of[1][0], of[0][1] - of[1][1]), 1);
    moved += 99;
    zoom(apart(is) / apart(was), mean(is, 0), mean(is, 1));
  }
  show();
});
listen(map, "pointerup", (event) => {
  const [px, py] = onCanvas(event);
  if (fingers.delete(event.pointerId) && moved < 6 * ratio()) call(eastOf(px), northOf(py));
});
listen(map, "pointercancel", (event) => fingers.delete(event.pointerId));
function scrub(event) {
  go(((event.offsetX - MARGIN.left) / (curve.clientWidth - MARGIN.left - MARGIN.right)) * D.end_s);
}
listen(curve, "pointerdown", (event) => {
  curve.setPointerCapture(event.pointerId);
  scrub(event);
});
listen(curve, "pointermove", (event) => {
  if (event.buttons) scrub(event);
});

// What changes around the page.
function repaint() {
  readColours();
  ground = null;
  show();
}
function paper(on) {
  onPaper = on;
  repaint();
}
listen(window, "resize", () => show());
listen(matchMedia("(prefers-color-scheme: dark)"), "change", repaint);
listen(window, "beforeprint", () => paper(true));
listen(window, "afterprint", () => paper(false));

// While a call is planned a better page takes this one's place, and shows what this one did.
const held = location.hash.slice(1).split(",").map(Number);
const isHeld = held.length === 6 && held.every(Number.isFinite);
if (isHeld && held[3]) [view, isWhole] = [{ x: held[1], y: held[2], scale: held[3] }, false];
repaint();
if (isHeld) $("panel").scrollTop = held[4];
if (document.head.querySelector("noscript")) setInterval(() => {
  if (fingers.size || pin) return;
  const how = following ? 0 : playing ? 1 : 2;
  location.replace("#" + [now, view.x, view.y, isWhole ? 0 : view.scale, $("panel").scrollTop, how]);
  location.reload();
}, 3000);
const gone = D.clock ? (Date.now() - D.clock.sighted_ms) / 1000 : -1;
if (isHeld && held[5]) {
  set(held[0]);
  play(held[5] === 1);
} else if (gone >= 0 && gone <= D.end_s) follow();
