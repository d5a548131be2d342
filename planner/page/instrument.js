// The form of the served page: asks its own server for a plan, and shows what comes of it.
const state = JSON.parse(document.getElementById("asked").textContent);
const $ = (id) => document.getElementById(id);
const form = $("ask"), fields = form.elements;
$("panel").prepend(form);
for (const [name, value] of Object.entries(state.said)) fields[name].value = value;
$("words").open = $("heard").open = $("files").hidden = !state.plans;
const tell = (text) => $("told").textContent === text || ($("told").textContent = text);

document.addEventListener("pin", ({ detail }) => {
  $("words").open = true;
  fields[fields.tap.value].value = detail.place;
  if (fields.tap.value === "last_seen") fields.heading.value = detail.heading;
});
async function post(path, content) {
  try {
    const answer = await fetch(path, { method: "POST", headers: { "Content-Type": "application/json" }, body: JSON.stringify(content) });
    if (!answer.ok) tell(await answer.text());
  } catch {
    tell("no answer: the server has ended, or is out of reach");
  }
}
form.addEventListener("submit", (event) => {
  event.preventDefault();
  const said = Object.fromEntries(new FormData(form));
  delete said.tap;
  post("/call", said);
});
$("stop").addEventListener("click", () => post("/stop", {}));

function running(on) {
  $("plan").disabled = on;
  $("stop").hidden = !on;
  if (!on) $("far").hidden = true;
}
function line(text) {
  const item = document.createElement("li");
  item.textContent = text;
  $("log").append(item);
  $("heard").hidden = false;
}
const newer = (event) => event.pages > state.pages && location.reload();
const told = {
  call(event) {
    $("log").replaceChildren();
    $("screen").hidden = true;
    running(true);
    tell("planning");
  },
  understood: (event) => event.said.forEach(([name, meant]) => line(name + ": " + meant)),
  progress(event) {
    $("far").hidden = false;
    $("far").max = event.total;
    $("far").value = event.done;
    tell("SUMO drives " + event.title);
  },
  cloud: newer,
  plan: newer,
  ended(event) {
    running(false);
    if (event.code) $("words").open = true;
  },
};
const stream = new EventSource("/events");
stream.onmessage = ({ data }) => {
  const event = JSON.parse(data);
  if (told[event.event]) told[event.event](event);
  if (event.text) {
    tell(event.text);
    if (event.event !== "ended") line(event.text);
  }
  if (event.screen && event.screen.length) {
    $("screen").hidden = false;
    $("screen").textContent = event.screen.join("\n").replace(new RegExp("\\n {2,}", "g"), " ");
  }
};
stream.onerror = () => tell("no word from the server; trying again");
running(false);
