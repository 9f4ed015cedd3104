// Where the page's data comes from, and where its orders go: hivtac on this computer. The page
// without a server has another file of this name.

/** Receives the events; a new connection repeats the last half minute. */
export function listen({ gone, ...handlers }) {
  const events = new EventSource("events");
  for (const [name, act] of Object.entries(handlers)) {
    events.addEventListener(name, (event) => act(JSON.parse(event.data)));
  }
  events.onerror = () => gone("hivtac has ended or does not answer: start it again, and open the " +
    "address that it prints");
}

/** Sends an order to a sensor; returns its answer, `done` and `text`. */
export async function order(sensor, what, more) {
  const body = JSON.stringify({ sensor, order: what, ...more });
  try {
    const response = await fetch("order", { method: "POST", body });
    return response.ok ? await response.json() : { text: await response.text() };
  } catch {
    return { text: "nothing answers" };
  }
}

/** Takes a sensor's next picture; returns its `bytes`, or the reason for a missing one as `text`. */
export async function picture(sensor) {
  try {
    const response = await fetch(`picture/${sensor}`);
    if (!response.ok) return { text: await response.text() };
    if (response.headers.get("content-type") === "application/json") return await response.json();
    return { bytes: new Uint8Array(await response.arrayBuffer()) };
  } catch {
    return { text: "nothing answers" };
  }
}
