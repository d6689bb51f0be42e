// Answers one question after another; whoever asked ends this worker where that takes too long.
let exported = null;

function answer(text) {
  const bytes = new TextEncoder().encode(text);
  const at = exported.room(bytes.length);
  new Uint8Array(exported.memory.buffer, at, bytes.length).set(bytes);
  exported.answer();
  const [start, length] = [exported.buffer(), exported.length()];
  return new TextDecoder().decode(new Uint8Array(exported.memory.buffer, start, length));
}

// Of an instance that panicked, the answer is the reason.
function reason(error) {
  try {
    return new TextDecoder().decode(new Uint8Array(exported.memory.buffer, exported.buffer(), exported.length())) || String(error);
  } catch {
    return String(error);
  }
}

onmessage = async ({ data }) => {
  if (data.module) {
    exported = (await WebAssembly.instantiate(data.module, {})).exports;
    return;
  }
  try {
    postMessage({ id: data.id, text: answer(data.text) });
  } catch (error) {
    postMessage({ id: data.id, broken: reason(error) });
  }
};
