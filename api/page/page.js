// STOP by plain HTTP, to the service and to the drive process itself, whichever answers; the notice of a dead socket, keys,
// and pictures of charts. Everything else is the server's.
document.addEventListener("submit", async (event) => {
  const form = event.target;
  const isOfHall = form.matches(".stop-of-rig");
  if (!isOfHall && !form.matches(".stop")) return;
  event.preventDefault();
  const said = form.querySelector("output");
  const tell = (text, kind) => {
    said.textContent = text;
    said.className = kind;
  };
  tell("Stopping …", "asked");
  const press = async (address) => {
    const answer = await fetch(address, { method: "POST", signal: AbortSignal.timeout(8000) });
    const told = await answer.json();
    if (!answer.ok) throw new Error(told.detail);
    return told;
  };
  const presses = [press(form.action)];
  if (form.dataset.port) presses.unshift(press(`http://${location.hostname}:${form.dataset.port}/stop`));
  try {
    const { detail } = await Promise.any(presses);
    tell(isOfHall ? `STOP at ${new Date().toLocaleTimeString()}: ${detail}.` : said.dataset.done, "rests");
  } catch (failed) {
    console.warn(failed.errors.map(String));
    tell(said.dataset.failed ?? "STOP FAILED: the actuator may still move. Press the red button on the machine.", "failed");
  }
});

// The outcome of a STOP is shown as long as it is so, and a failure until the next press. The page may hear of the rest later than the
// press does: what it shows before the STOP is in force there is the motion that the STOP has ended.
const tellByState = () => {
  const rests = document.querySelector(".stop output.rests");
  if (!rests) return;
  if (!rests.matches(".in-force") && document.querySelector("#stop-in-force")) rests.classList.add("in-force");
  if (rests.matches(".in-force") && document.querySelector("#rig-state.moving")) rests.textContent = rests.className = "";
};
new MutationObserver(tellByState).observe(document, { subtree: true, childList: true, attributes: true, attributeFilter: ["class"] });

window.thin = (value, digits = 5) => {
  if (typeof value !== "number") return value ?? "–";
  const text = Math.abs(value) >= 1e7 || (value && Math.abs(value) < 1e-4) ? value.toExponential(2) : String(+value.toPrecision(digits));
  const [whole, part] = text.split(".");
  return whole.replace(/\B(?=(\d{3})+$)/g, "\u202f") + (part ? `.${part}` : "");
};

// On a phone the views are one row that moves sideways, and so does the beam: the present view and the next point are in sight.
let sought = [];
const seek = () => {
  const found = [...document.querySelectorAll('.q-header nav [aria-current], .beam [data-next="true"]')];
  for (const each of found.filter((one) => !sought.includes(one))) {
    const row = each.closest("nav, .beam");
    const [inner, outer] = [each.getBoundingClientRect(), row.getBoundingClientRect()];
    row.scrollLeft += inner.left + inner.width / 2 - outer.left - outer.width / 2;
  }
  sought = found;
};
new MutationObserver(seek).observe(document, { subtree: true, childList: true });
addEventListener("resize", () => {
  sought = [];
  seek();
});

// The editor of a text has no name of its own, and its frame cannot be scrolled by keys.
const nameEditors = () => {
  document.querySelectorAll("[data-editor] .cm-content:not([aria-label])").forEach((each) => {
    each.setAttribute("aria-label", each.closest("[data-editor]").dataset.editor);
    each.closest(".cm-scroller").tabIndex = 0;
  });
};
new MutationObserver(nameEditors).observe(document, { subtree: true, childList: true });

const opened = Date.now();
let wasConnected = false;
setInterval(() => {
  window.socket?.io.reconnectionDelayMax(700); // left alone, it waits five seconds between attempts
  const connected = Boolean(window.socket?.connected);
  wasConnected ||= connected;
  const dead = !connected && (wasConnected || Date.now() - opened > 8000);
  if (document.body.classList.toggle("dead", dead) !== dead) return;
  // all but the STOPs of the hall, which need no socket; what is inside of an inert element cannot be used
  const beside = ".q-page:has(.stop-of-rig) *:not(:has(.stop-of-rig), .stop-of-rig, .stop-of-rig *)";
  const useless = `.q-page:not(:has(.stop-of-rig)), ${beside}, nav, .brand`;
  document.querySelectorAll(useless).forEach((each) => (each.inert = dead));
}, 250);

document.addEventListener("keydown", (event) => {
  if (event.key === "Escape") return document.querySelector(".stop button")?.click(); // from a field, too
  if (event.target.matches("input, select, textarea, [contenteditable=true]") || event.ctrlKey || event.altKey || event.metaKey) return;
  if (event.target.matches("button, a, summary") && event.key !== event.key.toLowerCase()) return;
  const button = document.querySelector(`[data-key="${CSS.escape(event.key)}"]:not([disabled])`);
  if (!button || (event.key === " " && event.target.matches("button, summary"))) return;
  event.preventDefault();
  if (!button.closest("[inert]")) button.click();
});

document.addEventListener("click", async (event) => {
  const button = event.target.closest("[data-picture]");
  if (!button) return;
  const { echarts } = await import("nicegui-echart");
  const element = button.closest("figure").querySelector(".chart");
  const chart = echarts.getInstanceByDom(element);
  const link = document.createElement("a");
  link.download = `${button.dataset.name}.${button.dataset.picture}`;
  if (button.dataset.picture === "png") {
    link.href = chart.getDataURL({ pixelRatio: 2, backgroundColor: "#fff" });
  } else {
    const size = { width: element.clientWidth, height: element.clientHeight };
    const drawn = echarts.init(null, null, { renderer: "svg", ssr: true, ...size });
    drawn.setOption({ ...chart.getOption(), animation: false });
    link.href = URL.createObjectURL(new Blob([drawn.renderToSVGString()], { type: "image/svg+xml" }));
    drawn.dispose();
  }
  link.click();
});
