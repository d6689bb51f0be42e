// A worker that is asked, and is ended and begun again where it is overtaken, is stopped or breaks.

const fetched = async (url) => {
  const response = await fetch(url);
  if (!response.ok) throw new Error(`${url}: ${response.status} ${response.statusText}`);
  return response;
};
const compiled = async (url) => WebAssembly.compile(await (await fetched(url)).arrayBuffer());
// The script of all workers, fetched once: one that begins again needs no network.
const script = fetched("worker.js").then(async (response) => URL.createObjectURL(new Blob([await response.text()], { type: "text/javascript" })));

export class Engine {
  #worker = null; #waiting = new Map(); #next = 0; #opened = null; #kept = []; #sent = null;

  // Of the WebAssembly module of this address, or of one that another engine has.
  constructor(of) {
    this.module = of instanceof Engine ? of.module : compiled(of);
  }

  // The files and the model from now on.
  open(files) {
    this.#opened = files;
  }

  // Asks the worker what it was not asked yet; one that was ended has begun again before.
  async #pump() {
    const [module, url] = await Promise.all([this.module, script]);
    this.#worker ??= this.#begun(module, url);
    for (const [id, one] of this.#waiting) {
      if (one.worker === this.#worker) continue;
      one.worker = this.#worker;
      this.#open(one.files);
      this.#worker.postMessage({ id, text: JSON.stringify(one.message) });
    }
  }

  #begun(module, url) {
    const worker = new Worker(url);
    this.#sent = null;
    worker.onmessage = ({ data }) => {
      const one = this.#waiting.get(data.id);
      if (one?.worker !== worker) return;
      this.#waiting.delete(data.id);
      if (data.broken == null) { one.resolve(JSON.parse(data.text)); return; }
      one.resolve({ ok: false, error: `dgd itself has a mistake: ${data.broken}` });
      this.#again();
    };
    worker.postMessage({ module });
    // Curves that were kept are in the worker: one that begins again computes them again.
    for (const { files, message } of this.#kept) {
      this.#open(files, worker);
      worker.postMessage({ id: -1, text: JSON.stringify(message) });
    }
    return worker;
  }

  #open(files, worker = this.#worker) {
    if (!files || this.#sent === files) return;
    this.#sent = files;
    worker.postMessage({ id: -1, text: JSON.stringify({ open: files }) });
  }

  // Ends the worker; another one is asked what it had not answered.
  #again() {
    this.#worker?.terminate();
    this.#worker = null;
    if (this.#waiting.size) this.#pump();
  }

  // Ends whatever it is doing; whoever waits hears so.
  end() {
    for (const one of this.#waiting.values()) one.resolve({ ok: false, overtaken: true });
    this.#waiting.clear();
    this.#again();
  }

  async ask(message, signal) {
    if (signal?.aborted) return { ok: false, overtaken: true };
    const files = this.#opened, id = this.#next++;
    const answered = new Promise((resolve) => this.#waiting.set(id, { resolve, files, message, worker: null }));
    signal?.addEventListener("abort", () => {
      const one = this.#waiting.get(id);
      if (!one) return;
      this.#waiting.delete(id);
      one.resolve({ ok: false, overtaken: true });
      if (one.worker) this.#again();
    }, { once: true });
    await this.#pump();
    const answer = await answered;
    if (answer.ok && ["keep", "drop"].includes(message.ask?.do)) this.#kept.push({ files, message });
    return answer;
  }
}
