// Shortcuts, which the panel lists.

const KEYS = [
  ["Space", "pause, go on"], ["R", "grow anew"], ["N", "new seed"], ["T E G", "turn, erase, graft"],
  ["[ ]", "smaller, larger brush"], ["1 … 6", "views"], ["← → ↑ ↓", "turn the object"], ["+ −", "nearer, farther"],
  ["Home", "see all of it"], ["S", "save a picture"], ["F", "film"], ["O", "open a mesh"],
];
const TURN_STEP = 0.1; // [rad]

function keysHelp() {
  const rows = KEYS.flatMap(([keys, what]) => [element("dt", {}, keys), element("dd", {}, what)]);
  return element("details", {}, element("summary", {}, "Keys"), element("dl", {}, ...rows));
}

function listenToKeys(panel) {
  const seen = (act) => () => {
    act(panel.page.studio.camera);
    panel.page.changed = true;
  };
  const alive = () => panel.page.automaton;
  const brush = (step) => () => alive() && panel.size(clamp(Number(panel.brush.querySelector("input").value) + step, 2, 40));
  const acts = {
    " ": () => alive() && panel.pause(), r: () => alive() && panel.page.reset(), n: () => alive() && panel.reseed(),
    t: () => panel.choose("turn"), e: () => panel.choose("erase"), g: () => panel.choose("graft"),
    "[": brush(-2), "]": brush(2), s: () => savePicture(panel.page), f: () => panel.record(),
    o: () => alive() && panel.ask(),
    ArrowLeft: seen((view) => view.turn(TURN_STEP, 0)), ArrowRight: seen((view) => view.turn(-TURN_STEP, 0)),
    ArrowUp: seen((view) => view.turn(0, TURN_STEP)), ArrowDown: seen((view) => view.turn(0, -TURN_STEP)),
    "+": seen((view) => view.zoom(0.9)), "-": seen((view) => view.zoom(1 / 0.9)), Home: seen((view) => view.fit()),
  };
  VIEWS.slice(0, 6).forEach(([mode], k) => {
    acts[k + 1] = () => (mode === "light" || panel.page.look.maps[mode]) && panel.show(mode);
  });
  document.addEventListener("keydown", (event) => {
    const act = acts[event.key.length === 1 ? event.key.toLowerCase() : event.key];
    const typing = event.target.closest("input, button, summary") && (event.key === " " || event.key.startsWith("Arrow"));
    if (!act || typing || event.ctrlKey || event.metaKey || event.altKey) return;
    event.preventDefault();
    act();
  });
}
