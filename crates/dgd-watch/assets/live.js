// A model that is played with: controls at the side, charts beside them. Who answers is told by `ask`: the server of
// `dgd watch`, or the worker of the playground.

const make = (tag, properties = {}, ...children) => {
  const element = Object.assign(document.createElement(tag), properties);
  element.append(...children);
  return element;
};
const { say } = dgdPage;

// A run that is overtaken may take so long before it is stopped, ms: shorter ones end by themselves, so that there is
// something to see while a slider moves.
const PATIENCE = 150;
// Nothing was moved for so long, ms: then what takes longer is computed.
const SETTLED = 250;
// Places of a slider.
const PLACES = 1000;
// Digits of a value that a slider gives.
const DIGITS = 4;

// ---- sliders ----

// From where to where a slider goes: the bounds; where one is missing, as far again as the value is from the other.
export function rangeOf({ value, bounds: [low, high], log }) {
  const size = Math.abs(value) || 1;
  if (log && (low ?? 0) > 0 && high != null) return { low, high, log };
  if (log && value > 0) return { low: low > 0 ? low : value / 100, high: high ?? value * 100, log };
  if (low != null && high != null) return { low, high, log: false };
  if (low != null) return { low, high: low + 2 * Math.max(Math.abs(value - low), value === low ? size : 0), log: false };
  if (high != null) return { low: high - 2 * Math.max(Math.abs(high - value), value === high ? size : 0), high, log: false };
  return null;
}
const ratio = ({ low, high }) => Math.log(high / low);
export const placeOf = (range, value) => {
  const part = range.log ? Math.log(value / range.low) / ratio(range) : (value - range.low) / (range.high - range.low);
  return Math.round(PLACES * Math.max(0, Math.min(1, part)));
};
export const valueAt = (range, place) => {
  const part = place / PLACES;
  if (part <= 0) return range.low;
  if (part >= 1) return range.high;
  const value = range.log ? range.low * Math.exp(part * ratio(range)) : range.low + part * (range.high - range.low);
  return Number(value.toPrecision(DIGITS));
};
const isWithin = (value, [low, high]) => Number.isFinite(value) && (low == null || value >= low) && (high == null || value <= high);
// A number as one writes it into a model.
const written = (value) => {
  const size = Math.abs(value);
  return size !== 0 && (size >= 1e6 || size < 1e-4) ? value.toExponential().replace("e+", "e") : String(value);
};
const withUnit = (value, unit) => `${written(value)}${unit === "1" ? "" : ` ${unit}`}`;

// ---- mistakes ----

// A sentence in which what stands between backticks is code.
const prose = (element, text) => {
  element.append(...text.split("`").map((piece, k) => (k % 2 ? make("code", { textContent: piece }) : piece)));
  return element;
};

// A few lines around a place, with it marked.
function excerpt(text, place) {
  const lines = text.split("\n");
  const [first, last] = [Math.max(1, place.line - 2), Math.min(lines.length, place.end_line + 2)];
  const pre = make("pre", { tabIndex: 0 });
  for (let line = first; line <= last; line++) {
    const all = [...(lines[line - 1] ?? "").replace(/\r$/, "")];
    pre.append(make("span", { className: "at", textContent: `${String(line).padStart(String(last).length)} │ ` }));
    if (line < place.line || line > place.end_line) { pre.append(`${all.join("")}\n`); continue; }
    const from = line === place.line ? place.column - 1 : 0;
    const to = line === place.end_line ? Math.max(place.end_column - 1, from + 1) : all.length;
    pre.append(all.slice(0, from).join(""), make("mark", { textContent: all.slice(from, to).join("") || " " }), `${all.slice(to).join("")}\n`);
  }
  return pre;
}

function mistakes(answer, goTo) {
  if (!answer.mistakes?.length) return [make("div", { className: "mistake" }, make("p", { className: "told", textContent: answer.error }))];
  return answer.mistakes.map((mistake) => {
    const box = make("div", { className: "mistake" });
    box.append(prose(make("p", { className: "told" }), `${mistake.code}: ${mistake.message}`));
    mistake.places.forEach((place, k) => {
      const text = answer.texts?.[place.file];
      const where = `${place.file}, line ${place.line}`;
      const label = goTo && text != null
        ? make("button", { type: "button", textContent: where, onclick: () => goTo(place) })
        : make("span", { textContent: where });
      box.append(make("p", { className: "more" }, label, place.text ? ` ${place.text}` : ""));
      if (text != null && k < 3) box.append(excerpt(text, place));
    });
    if (mistake.help) box.append(prose(make("p"), mistake.help));
    return box;
  });
}

// ---- the page ----

// `ask(what, signal)` answers; `first` is what to begin with; `write(values, variant)` writes into the file, where
// there is one; `goTo(place)` shows a place of a text; `extra` are elements for the side.
export function live({ ask, first, write, goTo, extra = [], title }) {
  const state = { variant: { ...first.variant }, apply: [...(first.apply ?? [])], values: { ...(first.values ?? {}) }, kept: [] };
  let controls = null, digest = null;

  dgdPage.start();
  const main = document.querySelector("main");
  main.classList.add("bench");
  const kind = make("p", { className: "kind", textContent: title });
  const headline = make("h1", { className: "plain", textContent: "…" });
  const news = make("p", { className: "news" });
  news.setAttribute("role", "status");
  const wrong = make("div", { className: "mistakes" });
  const remarks = make("div", { className: "remarks" });
  const agreement = make("div", { className: "agreement" });
  const charts = make("div", { className: "charts" });
  const slopes = make("div", { className: "charts slopes" });
  const side = make("div", { className: "side" });
  side.setAttribute("role", "region");
  side.setAttribute("aria-label", "Values and choices");
  const shownPart = make("div", { className: "shown" }, wrong, agreement, charts, slopes, remarks);
  main.append(kind, headline, news, make("div", { className: "columns" }, side, shownPart));

  const tell = (words, isBad = false) => {
    news.textContent = words;
    news.classList.toggle("bad", isBad);
  };

  // ---- controls ----

  const parts = { parameters: make("div"), choices: make("div"), kept: make("ul", { className: "kept" }), rows: new Map() };
  const button = (text, action, more = {}) => make("button", { type: "button", textContent: text, onclick: action, ...more });
  const keepButton = button("Keep this set", keep);
  const resetButton = button("All as at the beginning", () => {
    Object.assign(state, { values: {}, variant: { ...first.variant }, apply: [...(first.apply ?? [])] });
    controls = null;
    run();
  });
  const writeButton = write && button("Write into the file", writeValues);
  side.append(
    ...extra, make("h2", { textContent: "Parameters" }), parts.parameters,
    make("div", { className: "actions" }, keepButton, ...(write ? [writeButton] : []), resetButton),
    parts.kept, parts.choices,
  );

  const changed = (name) => Object.hasOwn(state.values, name);
  const declared = (parameter) => parameter.value;
  const current = (parameter) => (changed(parameter.name) ? state.values[parameter.name] : declared(parameter));

  function setValue(parameter, value) {
    if (value === declared(parameter)) delete state.values[parameter.name];
    else state.values[parameter.name] = value;
    refresh();
    run();
  }

  function rowOf(parameter, k) {
    const id = `parameter-${k}`;
    const label = make("label", { htmlFor: id }, make("code", { textContent: parameter.name }), " ");
    if (parameter.unit !== "1") label.append(make("span", { className: "unit", textContent: `[${parameter.unit}]` }));
    const field = make("input", { type: "number", step: "any", id });
    const row = make("div", { className: "parameter" }, label, field);
    const range = rangeOf(parameter);
    let slider = null;
    if (range) {
      slider = make("input", { type: "range", min: 0, max: PLACES, step: 1 });
      slider.setAttribute("aria-label", `${parameter.name}, slider`);
      slider.addEventListener("input", () => setValue(parameter, valueAt(range, Number(slider.value))));
      row.append(slider);
    }
    field.addEventListener("change", () => {
      const value = field.valueAsNumber;
      const isGood = isWithin(value, parameter.bounds);
      field.setAttribute("aria-invalid", String(!isGood));
      if (!isGood) {
        const [low, high] = parameter.bounds;
        tell(`${parameter.name} must be a number from ${low ?? "−∞"} to ${high ?? "∞"} ${parameter.unit === "1" ? "" : parameter.unit}`.trim(), true);
        return;
      }
      tell("");
      setValue(parameter, value);
    });
    if (parameter.doc) row.append(make("small", { textContent: parameter.doc }));
    const back = button("", () => { delete state.values[parameter.name]; refresh(); run(); field.focus(); }, { className: "back" });
    row.append(back);
    const update = (now) => {
      parameter = now;
      const value = current(now);
      if (document.activeElement !== field || field.valueAsNumber !== value) field.value = written(value);
      if (slider) {
        const place = placeOf(range, value);
        if (Number(slider.value) !== place) slider.value = place;
        slider.setAttribute("aria-valuetext", withUnit(value, now.unit));
      }
      row.classList.toggle("moved", changed(now.name));
      back.hidden = !changed(now.name);
      back.textContent = `back to ${written(declared(now))}`;
      back.setAttribute("aria-label", `${now.name} back to ${withUnit(declared(now), now.unit)}`);
    };
    return { row, update };
  }

  function choicesOf({ variants, effects }) {
    const all = [];
    variants.forEach(({ name, choices, chosen }, k) => {
      const select = make("select", { id: `variant-${k}` }, ...choices.map((choice) => make("option", { value: choice, textContent: choice })));
      select.value = chosen;
      select.addEventListener("change", () => { state.variant[name] = select.value; run(); });
      all.push(make("div", { className: "choice" }, make("label", { htmlFor: `variant-${k}` }, make("code", { textContent: name })), select));
    });
    const lists = [];
    if (all.length) lists.push(make("h2", { textContent: "Variants" }), ...all);
    if (effects.length) {
      const boxes = effects.map(({ name, doc }, k) => {
        const box = make("input", { type: "checkbox", id: `effect-${k}`, checked: state.apply.includes(name) });
        box.addEventListener("change", () => {
          state.apply = box.checked ? [...state.apply, name] : state.apply.filter((one) => one !== name);
          run();
        });
        const label = make("label", { htmlFor: box.id }, make("code", { textContent: name }));
        if (doc) label.append(make("br"), make("small", { textContent: doc }));
        return make("div", { className: "choice" }, box, label);
      });
      const details = make("details", { open: state.apply.length > 0 }, make("summary", { textContent: `Effects to try (${effects.length})` }), ...boxes);
      lists.push(make("h2", { textContent: "Effects" }), details);
    }
    return lists;
  }

  // The controls as they are declared; elements stay where nothing but values changed.
  const layout = (all) => JSON.stringify([
    all.parameters.map(({ name, unit, doc, bounds, log, value }) => [name, unit, doc, bounds, log, rangeOf({ value, bounds, log })]),
    all.variants.map(({ name, choices }) => [name, choices]), all.effects.map(({ name, doc }) => [name, doc]),
  ]);
  function take(next) {
    const isSame = controls && layout(controls) === layout(next);
    controls = next;
    for (const name of Object.keys(state.values)) {
      const own = next.parameters.find((one) => one.name === name);
      if (!own || own.value === state.values[name]) delete state.values[name];
    }
    if (!isSame) {
      const focused = document.activeElement?.id;
      parts.rows = new Map(next.parameters.map((one, k) => [one.name, rowOf(one, k)]));
      parts.parameters.replaceChildren(...[...parts.rows.values()].map(({ row }) => row));
      const wasOpen = parts.choices.querySelector("details")?.open;
      parts.choices.replaceChildren(...choicesOf(next));
      if (wasOpen) parts.choices.querySelector("details").open = true;
      if (focused) document.getElementById(focused)?.focus();
    }
    refresh();
  }
  function refresh() {
    if (!controls) return;
    for (const one of controls.parameters) parts.rows.get(one.name)?.update(one);
    const moved = controls.parameters.filter((one) => changed(one.name));
    const isFirst = JSON.stringify([state.variant, state.apply]) === JSON.stringify([first.variant ?? {}, first.apply ?? []]);
    resetButton.disabled = !moved.length && isFirst;
    if (write) writeButton.disabled = !moved.some((one) => one.writable);
  }

  // ---- asking ----

  let running = null, isWanted = false, overtaking = 0, settling = 0, saved = false;
  const request = (act, have) => ({ do: act, variant: state.variant, apply: state.apply, values: state.values, kept: state.kept.map((one) => one.number), have });

  function run({ save = false } = {}) {
    saved ||= save;
    isWanted = true;
    clearTimeout(settling);
    if (!running) { pump(); return; }
    const stop = running.stop, age = performance.now() - running.began;
    clearTimeout(overtaking);
    // What takes long for the sake of sensitivities goes at once.
    overtaking = setTimeout(() => stop.abort(), running.isLong || save ? 0 : Math.max(0, PATIENCE - age));
  }
  async function pump() {
    while (isWanted) {
      isWanted = false;
      await asked("run", views.run, false);
      await new Promise((drawn) => requestAnimationFrame(drawn));
    }
    settling = setTimeout(async () => { await asked("sensitivities", views.slopes, true); if (isWanted) pump(); }, SETTLED);
  }
  async function asked(act, view, isLong) {
    const stop = new AbortController();
    running = { stop, began: performance.now(), isLong };
    try {
      const answer = await ask(request(act, [...view.columns.keys()]), stop.signal);
      if (!answer.overtaken && !stop.signal.aborted) show(act, view, answer);
    } catch (error) {
      if (error.name !== "AbortError") tell(error.message, true);
    } finally {
      running = null;
      clearTimeout(overtaking);
    }
  }

  // ---- showing ----

  const views = { run: { element: charts, columns: new Map(), handle: null }, slopes: { element: slopes, columns: new Map(), handle: null } };
  let count = 0;

  function draw(view, answer) {
    const given = answer.charts;
    if (!given) { view.handle?.remove(); view.handle = null; view.element.replaceChildren(); view.columns = new Map(); return; }
    given.columns = given.columns.map((column, k) => column ?? view.columns.get(given.keys[k]));
    view.columns = new Map(given.keys.map((key, k) => [key, given.columns[k]]));
    if (view.handle?.update(given)) return;
    view.handle?.remove();
    view.element.innerHTML = answer.markup;
    view.handle = dgdPage.mount(view.element, given);
  }

  function show(act, view, answer) {
    view.element.classList.toggle("stale", !answer.ok);
    if (!answer.ok) {
      if (act === "run") {
        headline.textContent = answer.mistakes?.length === 1 ? "The model has a mistake" : answer.mistakes?.length ? `The model has ${answer.mistakes.length} mistakes` : "This could not be computed";
        headline.className = "doubt";
        wrong.replaceChildren(...mistakes(answer, goTo));
        resetButton.disabled = false;
        if (saved) tell("");
        if (saved) say(headline.textContent);
        saved = false;
        count += 1;
        document.documentElement.dataset.redraws = count;
      }
      return;
    }
    draw(view, answer);
    if (act !== "run") return;
    wrong.replaceChildren();
    headline.replaceChildren();
    prose(headline, answer.headline);
    headline.className = answer.stopped ? "doubt" : "plain";
    if (agreement.dataset.text !== answer.agreement) {
      agreement.innerHTML = answer.agreement;
      agreement.dataset.text = answer.agreement;
      dgdPage.sortTables(agreement);
    }
    remarks.replaceChildren(...answer.remarks.map((text) => make("p", { className: "caption", textContent: text })));
    digest = answer.digest;
    take(answer.controls);
    // Without a file there is nothing that was saved.
    if (saved) tell(write ? `Redrawn after a save, ${new Date().toLocaleTimeString("en-GB")}` : "");
    saved = false;
    count += 1;
    document.documentElement.dataset.redraws = count;
  }

  // ---- keeping and writing ----

  async function keep() {
    const answer = await ask({ ...request("keep", []) });
    if (!answer.ok) { tell(answer.error, true); return; }
    state.kept.push(answer.kept);
    showKept();
    tell(`Kept: ${answer.kept.what}`);
    run();
  }
  async function release(number) {
    await ask({ ...request("drop", []), kept: [number] });
    state.kept = state.kept.filter((one) => one.number !== number);
    showKept();
    run();
    keepButton.focus();
  }
  function showKept() {
    parts.kept.replaceChildren(...state.kept.map(({ number, what }) => make("li", {},
      make("span", { textContent: `kept ${number}: ${what}` }),
      button("Let go", () => release(number), { ariaLabel: `Let go of kept ${number}` }))));
  }
  async function writeValues() {
    const writable = controls.parameters.filter((one) => one.writable && changed(one.name));
    const values = Object.fromEntries(writable.map((one) => [one.name, state.values[one.name]]));
    const answer = await write({ values, variant: state.variant, digest });
    if (!answer.ok) { tell(answer.error, true); return; }
    tell(`Written into the file: ${writable.map((one) => `${one.name} = ${withUnit(values[one.name], one.unit)}`).join(", ")}`);
    run();
  }

  run();
  return {
    run, tell, state,
    // Values from elsewhere, such as those of a fit.
    setValues(values) { Object.assign(state.values, values); refresh(); run(); },
    // Another model: nothing of the last one stays.
    begin(next) {
      first = next;
      Object.assign(state, { variant: { ...next.variant }, apply: [...(next.apply ?? [])], values: { ...(next.values ?? {}) } });
      run({ save: true });
    },
  };
}
