// A model as a part of an address: its texts and what is chosen, compressed. Recordings are never in it.

const through = async (bytes, stream) => new Uint8Array(await new Response(new Blob([bytes]).stream().pipeThrough(stream)).arrayBuffer());

export async function packed(shared) {
  const bytes = await through(new TextEncoder().encode(JSON.stringify(shared)), new CompressionStream("deflate-raw"));
  let text = "";
  for (const byte of bytes) text += String.fromCharCode(byte);
  return btoa(text).replaceAll("+", "-").replaceAll("/", "_").replace(/=+$/, "");
}

// What was packed; null where it is not of ours.
export async function unpacked(text) {
  try {
    const bytes = Uint8Array.from(atob(text.replaceAll("-", "+").replaceAll("_", "/")), (c) => c.charCodeAt(0));
    const shared = JSON.parse(new TextDecoder().decode(await through(bytes, new DecompressionStream("deflate-raw"))));
    const isText = (one) => typeof one === "string";
    const isSound = isText(shared.model) && Object.values(shared.files ?? {}).every(isText) && isText(shared.files[shared.model]);
    return isSound ? shared : null;
  } catch {
    return null;
  }
}

// Reads a recording that was dropped; `.gz` is unpacked.
export async function textOf(file) {
  const stream = file.name.endsWith(".gz") ? file.stream().pipeThrough(new DecompressionStream("gzip")) : file.stream();
  return new Response(stream).text();
}
