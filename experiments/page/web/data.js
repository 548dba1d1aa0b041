// What the document brings along: packed JSON, bytes, libraries.

const find = name =>
  [...document.querySelectorAll('script[data-name]')].find(
    element => element.dataset.name === name,
  );

export function bytesOf(base64) {
  const text = atob(base64);
  const bytes = new Uint8Array(text.length);
  for (let i = 0; i < text.length; ++i) bytes[i] = text.charCodeAt(i);
  return bytes;
}

async function unpack(element) {
  const bytes = bytesOf(element.textContent);
  // not by way of a Blob: those go through the browser's process and may have to wait there
  const packed = new ReadableStream({
    start(control) {
      control.enqueue(bytes);
      control.close();
    },
  });
  return new Response(packed.pipeThrough(new DecompressionStream('gzip'))).text();
}

export const has = name => Boolean(find(name));

/** A packed part as the value that it is; null where the page does not have it. */
export async function load(name) {
  const element = find(name);
  return element ? JSON.parse(await unpack(element)) : null;
}

/** The address of bytes in the page, such as a video's; null where it has none. */
export function addressOf(name, type) {
  const element = find(name);
  return element ? URL.createObjectURL(new Blob([bytesOf(element.textContent)], {type})) : null;
}

/** Runs a library that the page brings along, once. */
const running = new Map();
export function library(name) {
  if (!running.has(name)) running.set(name, run(name));
  return running.get(name);
}
async function run(name) {
  const element = find(name);
  if (!element) throw new Error(`the page has no ${name}`);
  const script = document.createElement('script');
  script.textContent = await unpack(element);
  document.head.append(script);
}
