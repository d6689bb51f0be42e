// A worker that is asked, and is ended and begun again where it is overtaken, is stopped or breaks.

export class Engine {
  #module; #worker = null; #waiting = new Map(); #next = 0; #opened = null; #kept = []; #sent = null;

  // `url` is that of the WebAssembly module.
  constructor(url) {
    this.#module = fetch(url).then(async (response) => {
      if (!response.ok) throw new Error(`${url}: ${response.status} ${response.statusText}`);
      return WebAssembly.compile(await response.arrayBuffer());
    });
  }

  // The files and the model from now on.
  open(files) {
    this.#opened = files;
  }

  async #begun() {
    if (this.#worker) return this.#worker;
    const module = await this.#module;
    if (this.#worker) return this.#worker;
    const worker = new Worker("worker.js");
    this.#worker = worker;
    this.#sent = null;
    worker.onmessage = ({ data }) => {
      const one = this.#waiting.get(data.id);
      this.#waiting.delete(data.id);
      if (data.broken == null) { one?.resolve(JSON.parse(data.text)); return; }
      this.end(worker);
      one?.resolve({ ok: false, error: `dgd itself has a mistake: ${data.broken}` });
    };
    worker.postMessage({ module });
    // Curves that were kept are in the worker: one that begins again computes them again.
    for (const { files, message } of this.#kept) {
      this.#open(worker, files);
      worker.postMessage({ id: -1, text: JSON.stringify(message) });
    }
    return worker;
  }

  #open(worker, files) {
    if (!files || this.#sent === files) return;
    this.#sent = files;
    worker.postMessage({ id: -1, text: JSON.stringify({ open: files }) });
  }

  // Ends what it is doing; whoever waits for it hears so.
  end(worker = this.#worker) {
    if (!worker || worker !== this.#worker) return;
    worker.terminate();
    this.#worker = null;
    for (const one of this.#waiting.values()) one.resolve({ ok: false, overtaken: true });
    this.#waiting.clear();
  }

  async ask(message, signal) {
    const worker = await this.#begun();
    if (signal?.aborted) return { ok: false, overtaken: true };
    this.#open(worker, this.#opened);
    const id = this.#next++;
    const answered = new Promise((resolve) => this.#waiting.set(id, { resolve }));
    signal?.addEventListener("abort", () => { if (this.#waiting.has(id)) this.end(worker); }, { once: true });
    worker.postMessage({ id, text: JSON.stringify(message) });
    const answer = await answered;
    if (answer.ok && ["keep", "drop"].includes(message.ask?.do)) this.#kept.push({ files: this.#opened, message });
    return answer;
  }
}
