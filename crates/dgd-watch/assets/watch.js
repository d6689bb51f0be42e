// The page of `dgd watch`: asks the server on this machine, and hears from it when a file was saved.
import { live } from "./live.js";

const secret = location.hash.slice(1);
const headers = { "x-dgd-secret": secret };

async function sent(path, options = {}) {
  const response = await fetch(path, { cache: "no-store", headers, ...options });
  const isJson = response.headers.get("content-type")?.startsWith("application/json");
  if (!isJson) throw new Error(await response.text());
  return response.json();
}
const posted = (path, body, signal) => sent(path, { method: "POST", body: JSON.stringify(body), signal });

// The names of server-sent events as they come; EventSource cannot send a header.
async function* events() {
  const response = await fetch("events", { cache: "no-store", headers });
  if (!response.ok) throw new Error(await response.text());
  const reader = response.body.pipeThrough(new TextDecoderStream()).getReader();
  let text = "";
  for (;;) {
    const { done, value } = await reader.read();
    if (done) return;
    text += value;
    const blocks = text.split("\n\n");
    text = blocks.pop();
    for (const block of blocks) {
      const name = block.split("\n").find((line) => line.startsWith("event:"));
      if (name) yield name.slice(6).trim();
    }
  }
}

async function listen(page) {
  try {
    for await (const name of events()) if (name === "saved") page.run({ save: true });
  } catch { /* The same is said of a server that went away. */ }
  page.tell("dgd watch has ended. What is drawn is what it last gave.", true);
  document.documentElement.dataset.ended = "true";
}

const main = document.querySelector("main");
try {
  const first = await sent("first");
  document.title = `${first.file} – dgd watch`;
  const title = first.data ? `${first.file}, driven by ${first.data}` : first.file;
  const page = live({
    first, title,
    ask: (what, signal) => posted("ask", what, signal),
    write: (what) => posted("write", what),
  });
  listen(page);
} catch (error) {
  main.append(Object.assign(document.createElement("p"), { textContent: error.message }));
}
