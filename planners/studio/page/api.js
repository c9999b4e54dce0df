// The server: plain requests, and jobs that answer line by line. To abort a job is to cancel it there.

export class ApiError extends Error {
  constructor(kind, message) {
    super(message);
    this.kind = kind; // input, limit, time, busy, internal, cancelled or lost
  }
}
const LOST = "The studio's server does not answer. Is the command `hrsnake studio` still running?";

async function request(path, options) {
  try {
    return await fetch(path, { cache: "no-store", ...options });
  } catch (error) {
    if (error.name === "AbortError") throw new ApiError("cancelled", "Cancelled.");
    throw new ApiError("lost", LOST);
  }
}

/** The one sentence that a refusal holds, whatever its form. */
async function refusal(response) {
  let said = null;
  const text = await response.text().catch(() => "");
  try { said = JSON.parse(text.trim().split("\n").pop()); } catch { said = null; }
  const sentence = [said?.message, said?.detail, said?.error].find((one) => typeof one === "string");
  const kind = said?.kind ?? (response.status === 503 ? "busy" : response.status < 500 ? "input" : "internal");
  const usual = response.status === 413 ? "This is more than the server takes." : `The server has refused: ${response.status} ${response.statusText}.`;
  return new ApiError(kind, sentence ?? usual);
}

export async function get(path) {
  const response = await request(path);
  if (!response.ok) throw await refusal(response);
  return response.json();
}

/** Run a job: returns its result. `heard` gets its lines (job, queued, progress) as they come. */
export async function job(path, body, { signal, heard = () => {} } = {}) {
  const response = await request(path, {
    method: "POST", signal, headers: { "Content-Type": "application/json" }, body: JSON.stringify(body),
  });
  if (!response.ok || !response.body) throw await refusal(response);
  for await (const line of linesOf(response.body, signal)) {
    if (line.type === "done") return line.result;
    if (line.type === "error") throw new ApiError(line.kind, line.message);
    heard(line);
  }
  throw new ApiError("lost", LOST);
}

async function* linesOf(stream, signal) {
  const reader = stream.pipeThrough(new TextDecoderStream()).getReader();
  let parts = [];
  while (true) {
    let chunk;
    try {
      chunk = await reader.read();
    } catch {
      throw signal?.aborted ? new ApiError("cancelled", "Cancelled.") : new ApiError("lost", LOST);
    }
    const text = chunk.value ?? "", lines = text.split("\n");
    parts.push(lines[0]);
    for (const next of lines.slice(1)) {
      const line = parts.join("");
      parts = [next];
      if (line.trim()) yield JSON.parse(line);
    }
    if (chunk.done) {
      const line = parts.join("");
      if (line.trim()) yield JSON.parse(line);
      return;
    }
  }
}

/** Ask a running search to stop with its best so far. */
export async function stop(id) {
  const response = await request(`/api/stop/${encodeURIComponent(id)}`, { method: "POST", headers: { "Content-Type": "application/json" }, body: "{}" });
  if (!response.ok) throw await refusal(response);
}

export function base64Of(bytes) {
  let text = "";
  for (let at = 0; at < bytes.length; at += 0x8000) text += String.fromCharCode(...bytes.subarray(at, at + 0x8000));
  return btoa(text);
}

export function download(name, data, type) {
  const link = document.createElement("a");
  link.href = URL.createObjectURL(new Blob([data], { type }));
  link.download = name;
  document.body.append(link);
  link.click();
  link.remove();
  setTimeout(() => URL.revokeObjectURL(link.href), 10000);
}
