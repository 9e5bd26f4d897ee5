// Opens the page. With #still nothing moves by itself, which is for those who drive it from outside.

async function open() {
  const by = (id) => document.getElementById(id);
  const data = await unpacked(JSON.parse(by("data").textContent));
  const canvas = by("picture");
  const page = data.looks ? new Page(data, canvas) : await StillPage.of(data, canvas);
  page.studio.paper = paperOf(canvas);
  const still = location.hash === "#still";
  const fit = () => {
    const scale = still ? 1 : Math.min(window.devicePixelRatio || 1, 2);
    canvas.width = Math.max(Math.round(canvas.clientWidth * scale), 1);
    canvas.height = Math.max(Math.round(canvas.clientHeight * scale), 1);
    page.changed = true;
  };
  fit();
  page.draw();
  by("instead").hidden = true;
  if (still) return page;
  new ResizeObserver(fit).observe(canvas);
  const clock = new Clock(page, (counts) => { by("status").textContent = counted(page, counts); });
  const panel = new Panel(page, clock, new Pointer(page, by("cursor")), { panel: by("panel"), status: by("status") });
  listenToKeys(page, panel);
  listenToDrops(panel);
  if (data.live) follow(page, panel);
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => {
    page.studio.paper = paperOf(canvas);
    page.changed = true;
  });
  return page;
}

function counted({ automaton, surface }, { frames, steps }) {
  if (!automaton) return `${surface.faceCount.toLocaleString()} faces`;
  return [`${automaton.steps.toLocaleString()} steps`, `${Math.round(steps)} a second`,
    `${Math.round(frames)} frames/s`, `${surface.mesh.count.toLocaleString()} cells`].join(" · ");
}

function listenToDrops(panel) {
  const { body } = document;
  const over = (event, on) => {
    event.preventDefault();
    body.classList.toggle("over", on);
  };
  body.addEventListener("dragover", (event) => over(event, true));
  body.addEventListener("dragleave", (event) => over(event, false));
  body.addEventListener("drop", (event) => {
    over(event, false);
    panel.open(event.dataTransfer.files[0]);
  });
}

// The colour of the page's paper, linear.
function paperOf(node) {
  const [r, g, b] = getComputedStyle(node.ownerDocument.body).backgroundColor.match(/[\d.]+/g).map(Number);
  return [r, g, b].map((x) => ((x / 255 + 0.055) / 1.055) ** 2.4);
}

function explain(error) {
  document.getElementById("message").textContent =
    `This texture would grow here, but ${error.message}. The picture shows it as Mitex grew it.`;
  document.body.classList.add("still");
}

window.mitex = open();
window.mitex.catch(explain);
