// The playground: an editor, and the page of `dgd watch` beside it, answered by a worker of this browser.
import { live } from "./live.js";
import { Engine } from "./engine.js";
import { packed, textOf, unpacked } from "./share.js";

const make = (tag, properties = {}, ...children) => {
  const element = Object.assign(document.createElement(tag), properties);
  element.append(...children);
  return element;
};
const button = (textContent, onclick, more = {}) => make("button", { type: "button", textContent, onclick, ...more });
// A model without a recording runs so long, s, unless told otherwise.
const UNTIL = 100;
// Nothing was typed for so long, ms.
const TYPED = 150;
// Digits of an estimate that a slider takes.
const SHOWN = 7;

const engine = new Engine("dgd.wasm");
// Fits and searches have workers of their own: a slider that moves meanwhile does not end them.
const fitter = new Engine(engine);
let searcher = null;
// What is open: files by path, the model among them, the recording, what inputs are held at where there is none.
const open = { files: {}, model: "model.dgd", data: null, valid: null, until: UNTIL, held: {} };
let shownFile = open.model, page = null;

// ---- the editor ----

const area = make("textarea", { spellcheck: false, id: "text", autocapitalize: "off" });
area.setAttribute("aria-label", "Text of the model");
const marks = make("pre");
marks.setAttribute("aria-hidden", "true");
const editor = make("div", { className: "editor" }, marks, area);
const fileChoice = make("select");
fileChoice.setAttribute("aria-label", "File");
area.addEventListener("scroll", () => { [marks.scrollTop, marks.scrollLeft] = [area.scrollTop, area.scrollLeft]; });
let typing = 0;
area.addEventListener("input", () => {
  open.files[shownFile] = area.value;
  marks.replaceChildren();
  clearTimeout(typing);
  typing = setTimeout(changed, TYPED);
});
fileChoice.addEventListener("change", () => showFile(fileChoice.value));

function showFile(name) {
  shownFile = name;
  area.value = open.files[name];
  marks.replaceChildren();
  fileChoice.value = name;
}

// Where a line and column, both from 1, are in a text.
function offset(text, line, column) {
  const lines = text.split("\n");
  const before = lines.slice(0, line - 1).reduce((sum, one) => sum + one.length + 1, 0);
  return before + [...(lines[line - 1] ?? "")].slice(0, column - 1).join("").length;
}

function mark(answer) {
  marks.replaceChildren();
  const text = area.value;
  const places = (answer.mistakes ?? []).flatMap((mistake) => mistake.places.slice(0, 1)).filter((place) => place.file === shownFile);
  const spans = places.map((place) => [offset(text, place.line, place.column), offset(text, place.end_line, place.end_column)]);
  spans.sort((a, b) => a[0] - b[0]);
  let at = 0;
  for (const [from, to] of spans) {
    if (from < at) continue;
    const end = Math.max(to, from + 1);
    marks.append(text.slice(at, from), make("mark", { textContent: text.slice(from, end) || " " }));
    at = end;
  }
  marks.append(`${text.slice(at)}\n`);
  [marks.scrollTop, marks.scrollLeft] = [area.scrollTop, area.scrollLeft];
  area.setAttribute("aria-invalid", String(spans.length > 0));
}

function goTo(place) {
  if (open.files[place.file] == null) return;
  if (place.file !== shownFile) showFile(place.file);
  area.focus();
  area.setSelectionRange(offset(area.value, place.line, place.column), offset(area.value, place.end_line, place.end_column));
}

// ---- recordings ----

const dropped = make("p", { textContent: "No recording." });
const chooser = (label, take) => {
  const input = make("input", { type: "file", accept: ".csv,.gz,text/csv" });
  input.addEventListener("change", () => { if (input.files[0]) take(input.files[0]); });
  return make("label", { textContent: `${label} ` }, input);
};
const removeData = button("Without it", () => { open.data = null; changed(); }, { hidden: true });
const validNote = make("span");
const zone = make("div", { className: "drop" },
  dropped, chooser("Choose or drop a CSV:", takeData), removeData,
  make("p", { className: "caption", textContent: "It stays in this page: it is not sent anywhere, and it is not in the link." }));
zone.addEventListener("dragover", (event) => { event.preventDefault(); zone.classList.add("over"); });
zone.addEventListener("dragleave", () => zone.classList.remove("over"));
zone.addEventListener("drop", (event) => {
  event.preventDefault();
  zone.classList.remove("over");
  if (event.dataTransfer.files[0]) takeData(event.dataTransfer.files[0]);
});
async function takeData(file) {
  try {
    open.data = { name: file.name.replace(/\.gz$/, ""), text: await textOf(file) };
    changed();
  } catch (error) {
    page.tell(`${file.name} could not be read: ${error.message}`, true);
  }
}
async function takeValid(file) {
  open.valid = { name: `valid/${file.name.replace(/\.gz$/, "")}`, text: await textOf(file) };
  validNote.textContent = file.name;
}

// Without a recording: how long, and what the inputs are held at.
const heldFields = make("div", { className: "bar" });
function showHeld(inputs) {
  const until = make("input", { type: "number", step: "any", value: open.until });
  until.addEventListener("change", () => { if (until.valueAsNumber > 0) { open.until = until.valueAsNumber; changed(); } });
  const fields = inputs.map(({ name, unit }) => {
    const field = make("input", { type: "number", step: "any", value: open.held[name] ?? 1 });
    field.addEventListener("change", () => { if (Number.isFinite(field.valueAsNumber)) { open.held[name] = field.valueAsNumber; changed(); } });
    return make("label", { textContent: `${name} [${unit}] ` }, field);
  });
  const focused = heldFields.contains(document.activeElement) ? [...heldFields.querySelectorAll("input")].indexOf(document.activeElement) : -1;
  heldFields.replaceChildren(make("label", { textContent: "until, s " }, until), ...fields);
  if (focused >= 0) heldFields.querySelectorAll("input")[focused]?.focus();
}

// ---- from what is open to what the worker is given ----

let turn = 0;
async function changed() {
  const own = ++turn;
  dropped.textContent = open.data ? `Recording: ${open.data.name}` : "No recording.";
  removeData.hidden = !open.data;
  fitButton.disabled = !open.data;
  findButton.disabled = !open.data;
  const { files, model, data } = open;
  if (data) {
    heldFields.replaceChildren();
    engine.open({ files: { ...files, [data.name]: data.text }, model, data: data.name });
  } else {
    engine.open({ files: { ...files }, model, until: open.until });
    const answer = await engine.ask({ inputs: {} });
    if (own !== turn) return;
    if (answer.ok) {
      showHeld(answer.inputs);
      if (answer.inputs.length) {
        const head = answer.inputs.map(({ name, unit }) => `${name} [${unit}]`);
        const row = answer.inputs.map(({ name }) => open.held[name] ?? 1).join(",");
        const text = `time [s],${head.join(",")}\n0,${row}\n${open.until},${row}\n`;
        engine.open({ files: { ...files, "held.csv": text }, model, data: "held.csv", every: open.until / 1000 });
      }
    }
  }
  page?.run({ save: true });
}

function take(next) {
  Object.assign(open, { data: null, valid: null, until: UNTIL, held: {} }, next);
  fileChoice.replaceChildren(...Object.keys(open.files).sort((a, b) => (b === open.model) - (a === open.model) || a.localeCompare(b))
    .map((name) => make("option", { value: name, textContent: name })));
  fileChoice.hidden = Object.keys(open.files).length < 2;
  validNote.textContent = open.valid?.name ?? "";
  result.replaceChildren();
  showFile(open.model);
}

// ---- examples and links ----

const examples = await (await fetch("examples.json")).json();
const exampleChoice = make("select", { id: "example" }, ...examples.map(({ title }, k) => make("option", { value: k, textContent: title })));
exampleChoice.addEventListener("change", async () => {
  take(await example(Number(exampleChoice.value)));
  history.replaceState(null, "", location.pathname);
  await changed();
  page.begin({});
});
async function example(k) {
  const { files, model, data, valid, until, held } = examples[k];
  const text = async (name) => (await fetch(`examples/${name}`)).text();
  const all = Object.fromEntries(await Promise.all(files.map(async (name) => [name, await text(name)])));
  const recording = async (name) => (name ? { name, text: await text(name) } : null);
  return { files: all, model, data: await recording(data), valid: await recording(valid), until: until ?? UNTIL, held: held ?? {} };
}

async function share() {
  const { variant, apply, values } = page.state;
  const { files, model, until, held } = open;
  history.replaceState(null, "", `#m=${await packed({ files, model, until, held, variant, apply, values })}`);
  try {
    await navigator.clipboard.writeText(location.href);
    page.tell(`The link has been copied; it holds the model${open.data ? ", not the recording" : ""}.`);
  } catch {
    page.tell("The link is the address of this page now.");
  }
}

// ---- fits and discoveries ----

const result = make("div");
const stopButton = button("Stop", () => { fitter.end(); searcher?.end(); }, { hidden: true });
const fitButton = button("Fit to the recording", fit);
const findButton = button("Find what is missing", find);

async function busy(words, work) {
  page.tell(words);
  stopButton.hidden = false;
  fitButton.disabled = findButton.disabled = true;
  const began = performance.now();
  try {
    const answer = await work();
    if (answer.overtaken) page.tell("Stopped.");
    else if (!answer.ok) page.tell(answer.error, true);
    else page.tell(`Done in ${((performance.now() - began) / 1000).toFixed(1)} s.`);
    return answer.ok ? answer : null;
  } finally {
    stopButton.hidden = true;
    fitButton.disabled = findButton.disabled = !open.data;
  }
}
const told = (text) => make("pre", { className: "result", textContent: text, tabIndex: 0 });

async function fit() {
  const { variant, apply, values } = page.state;
  fitter.open({ files: { ...open.files, [open.data.name]: open.data.text }, model: open.model, data: open.data.name });
  const answer = await busy("Fitting …", () => fitter.ask({ ask: { do: "fit", variant, apply, values } }));
  if (!answer) return;
  result.replaceChildren(make("h2", { textContent: "The fit" }), told(answer.text));
  page.setValues(Object.fromEntries(Object.entries(answer.parameters).map(([name, { value }]) => [name, Number(value.toPrecision(SHOWN))])));
}

async function find() {
  searcher ??= new Engine("dgd-discover.wasm");
  const valid = open.valid ?? open.data;
  searcher.open({ files: { ...open.files, [open.data.name]: open.data.text, [valid.name]: valid.text }, model: open.model, data: open.data.name });
  const wanted = { discover: { valid: valid.name, variant: page.state.variant } };
  const answer = await busy("Searching; this takes minutes …", () => searcher.ask(wanted));
  if (!answer) return;
  const report = URL.createObjectURL(new Blob([answer.page], { type: "text/html" }));
  result.replaceChildren(make("h2", { textContent: "What is missing" }), told(answer.text),
    make("p", {}, make("a", { href: report, download: "report.html", textContent: "The report, to save and open" })));
}

// ---- all of it ----

const shared = location.hash.startsWith("#m=") ? await unpacked(location.hash.slice(3)) : null;
const [beginning, wrong] = shared ? [{ ...shared, data: null }, false] : [await example(0), location.hash.startsWith("#m=")];
take(beginning);
const extra = [
  make("div", { className: "bar" }, make("label", { textContent: "Example " }, exampleChoice), fileChoice, button("Share as a link", share)),
  editor, zone, heldFields,
  make("div", { className: "bar" }, fitButton, findButton, stopButton),
  make("details", {}, make("summary", { textContent: "A second recording, for validation" }), chooser("CSV:", takeValid), validNote),
  result,
];
const first = shared ?? {};
await changed();
page = live({
  first, goTo, extra,
  title: "dgd playground: all is computed in this page",
  ask: async (what, signal) => {
    const answer = await engine.ask({ ask: what }, signal);
    if (what.do === "run" && !answer.overtaken) mark(answer);
    return answer;
  },
});
if (wrong) page.tell("The link could not be read; this is an example.", true);
