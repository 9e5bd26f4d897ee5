// Opens the page. With #still=SIDE nothing moves by itself, and pictures are squares of so many pixels: for
// those who drive it from outside. #steps=webgl and #steps=webgpu say what takes the steps.

async function open() {
  const by = (id) => document.getElementById(id);
  const data = await unpacked(JSON.parse(by("data").textContent));
  const canvas = by("picture");
  const options = new URLSearchParams(location.hash.slice(1));
  const graphics = new Graphics(canvas);
  const page = data.looks ? new Page(data, graphics, await computeDevice(options.get("steps"), graphics))
    : await StillPage.of(data, graphics);
  page.studio.paper = paperOf(canvas);
  const still = Number(options.get("still"));
  const fit = () => {
    const scale = Math.min(window.devicePixelRatio || 1, 2);
    canvas.width = still || Math.max(Math.round(canvas.clientWidth * scale), 1);
    canvas.height = still || Math.max(Math.round(canvas.clientHeight * scale), 1);
  };
  fit();
  page.draw();
  by("instead").hidden = true;
  const clock = new Clock(page, (counts) => { by("status").textContent = counted(clock.page, counts); });
  const panel = new Panel(page, clock, new Pointer(page, by("cursor")), { panel: by("panel"), status: by("status") });
  listenToKeys(panel);
  listenToDrops(panel);
  page.panel = panel;
  if (data.live) follow(page, panel);
  if (still) return page;
  clock.start();
  const again = () => { clock.page.changed = true; };
  new ResizeObserver(() => { fit(); again(); }).observe(canvas);
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => {
    page.studio.paper = paperOf(canvas);
    again();
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
