// Odds against time: each flight's, what no flight surpasses, and a cursor.
const curve = $("curve"), ink = curve.getContext("2d");
const DASHES = [[], [7, 3], [3, 3], [9, 3, 2, 3], [12, 4]];
const MARGIN = { left: 44, right: 12, top: 8, bottom: 24 };
const look = (i) => {
  if (i + 1 === D.curves.length) return [colours.fg, [1.5, 3], 1.5];
  return [i ? colours["c" + clip(i, 1, 5)] : colours.uav, DASHES[Math.min(i, DASHES.length - 1)], i ? 1.8 : 3.2];
};
function drawCurves(s) {
  if (!D.curves.length) return;
  sized(curve);
  const r = ratio(), left = MARGIN.left * r, bottom = curve.height - MARGIN.bottom * r, top = MARGIN.top * r, right = curve.width - MARGIN.right * r;
  const x = (time) => left + ((right - left) * time) / D.end_s, y = (p) => bottom - (bottom - top) * p;
  ink.clearRect(0, 0, curve.width, curve.height);
  write(ink, 11, "right", "middle");
  ink.lineWidth = r;
  ink.strokeStyle = colours.line;
  ink.fillStyle = colours.dim;
  for (const p of [0, 0.25, 0.5, 0.75, 1]) {
    stroke(ink, [[left, y(p)], [right, y(p)]]);
    ink.fillText(100 * p + " %", left - 6 * r, y(p));
  }
  write(ink, 11, "center", "top");
  const step = [60, 120, 300, 600, 900, 1800, 3600, 7200].find((n) => D.end_s / n <= 6.5) || 14400;
  const past = D.clock ? (D.clock.sighted_ms / 1000 + D.clock.offset_min * 60) % step : 0;
  for (let time = past ? step - past : 0; time <= D.end_s; time += step) {
    stroke(ink, [[x(time), bottom], [x(time), bottom + 4 * r]]);
    ink.fillText(short(time) + (D.clock ? "" : " min"), Math.min(x(time), right - 12 * r), bottom + 7 * r);
  }
  ink.save();
  for (let i = D.curves.length - 1; i >= 0; i--) {
    const [colour, dash, width] = look(i), points = D.curves[i];
    ink.strokeStyle = colour;
    ink.lineWidth = width * r;
    ink.setLineDash(dash.map((n) => n * r));
    stroke(ink, points.map((p, k) => [x((k * D.end_s) / (points.length - 1)), y(p)]));
  }
  ink.restore();
  ink.strokeStyle = ink.fillStyle = colours.fg;
  ink.lineWidth = 1.5 * r;
  stroke(ink, [[x(s), top], [x(s), bottom]]);
  ink.beginPath();
  ink.arc(x(s), y(found(D.curves[0], s)), 4 * r, 0, 7);
  ink.fill();
}
