const D = JSON.parse(document.getElementById("data").textContent);
const $ = (id) => document.getElementById(id);
const add = (parent, tag, text) => {
  const made = document.createElement(tag);
  made.textContent = text;
  return parent.appendChild(made);
};
const listen = (what, event, act, how) => what.addEventListener(event, act, how);
const aria = (what, name, text) => what.setAttribute("aria-" + name, text);
const clip = (x, low, high) => Math.min(Math.max(x, low), high);

// Columns: two bytes a number, the low one first.
const unpack = (text) => {
  const bytes = Uint8Array.from(atob(text), (c) => c.charCodeAt(0));
  return Uint16Array.from({ length: bytes.length / 2 }, (_, i) => bytes[2 * i] | (bytes[2 * i + 1] << 8));
};
const offsets = (counts) => {
  const first = [0];
  for (const n of counts) first.push(first[first.length - 1] + n);
  return first;
};

// Times: of day at the place of the search, whatever the reader's zone; else since the sighting.
const pad = (n) => String(n).padStart(2, "0");
const span = (s) => {
  const n = Math.round(Math.abs(s));
  return (s < 0 ? "-" : "") + Math.floor(n / 3600) + ":" + pad(Math.floor(n / 60) % 60) + ":" + pad(n % 60);
};
const moment = (s) => new Date(D.clock.sighted_ms + Math.round(s) * 1000 + D.clock.offset_min * 60000).toISOString();
const clock = (s) => (D.clock ? moment(s).slice(11, 19) : span(s));
const short = (s) => (D.clock ? moment(s).slice(11, 16) : String(Math.round(s / 60)));
const zone = () => {
  const off = Math.abs(D.clock.offset_min);
  return (D.clock.offset_min < 0 ? "-" : "+") + pad(Math.floor(off / 60)) + ":" + pad(off % 60);
};

const odds = (p) => {
  const n = Math.floor(100 * p + 0.5);
  return p > 0 && n === 0 ? "<1 %" : p < 1 && n === 100 ? ">99 %" : n + " %";
};
const found = (curve, s) => {
  const at = clip(s / D.end_s, 0, 1) * (curve.length - 1), k = Math.floor(at);
  return k + 1 < curve.length ? curve[k] + (at - k) * (curve[k + 1] - curve[k]) : curve[k];
};
const rounded = (x) => [1, 2, 5, 10].map((k) => k * 10 ** Math.floor(Math.log10(x))).filter((k) => k <= x).pop();
