// The panel: what can be done with the page, in sections.

const SPEEDS = [2, 5, 10, 20, 30, 60, 120, 240, 480]; // steps a second
const VIEWS = [
  ["light", "Light"], ["albedo", "Colour"], ["normal", "Normal"], ["height", "Height"],
  ["roughness", "Rough"], ["ambient_occlusion", "Occlusion"],
];

class Panel {
  constructor(page, clock, pointer, place) {
    Object.assign(this, { page, clock, pointer, place });
    const degrees = (page.turn * 180) / Math.PI;
    this.play = button("Pause", "Pause or go on (space)", () => this.pause(), "main");
    this.tools = choice("Tool", this._tools(), "turn", (tool) => this.choose(tool));
    this.view = choice("View", VIEWS.filter(([key]) => key === "light" || page.look.maps[key]), "light",
      (mode) => this.show(mode));
    place.append(
      element("header", {}, element("h1", {}, page.data.name), element("p", {}, this._subtitle())),
      element("div", { className: "row" }, this.play,
        button("Grow anew", "Back to the seed (R)", () => page.reset()),
        button("Another seed", "The same look, another arrangement (N)", () => this.reseed())),
      section("Hand", this.tools, this.brush = slider("Brush", { low: 2, high: 40, step: 1, value: 15,
        text: (x) => `${x} %` }, (x) => this.size(x))),
      section("Texture",
        this.speed = slider("Speed", { low: 0, high: SPEEDS.length - 1, step: 1, value: SPEEDS.indexOf(clock.rate),
          text: (k) => `${SPEEDS[k]} steps/s` }, (k) => { clock.rate = SPEEDS[k]; }),
        slider("Orientation", { low: -180, high: 180, step: 1, value: degrees, text: (x) => `${x}°` },
          (x) => page.orient((x * Math.PI) / 180))),
      ...this._motion(),
      section("View", this.view, slider("Exposure", { low: -2, high: 2, step: 0.1, value: 0,
        text: (x) => `${x > 0 ? "+" : ""}${x.toFixed(1)}` }, (x) => this.expose(x))),
    );
  }

  _subtitle() {
    return `${this.page.look.name}, growing as you watch`;
  }

  // Where a texture moves that can.
  _motion() {
    const { page } = this;
    if (!page.look.condition) return [];
    const fields = choice("Direction", FIELDS.map((name) => [name, name.replace("-", " ")]), page.field, (name) => {
      page.move(name, page.speed);
      fields.set(name);
    });
    return [section("Motion", fields, slider("Pace", { low: 0, high: 3, step: 0.1, value: page.speed,
      text: (x) => `${x.toFixed(1)} x` }, (x) => page.move(page.field, x)))];
  }

  _tools() {
    return [["turn", "Turn", "Drag to turn the object (T)"], ["erase", "Erase", "Wipe it off, and see it heal (E)"]];
  }

  pause(playing = !this.clock.playing) {
    this.clock.playing = playing;
    this.play.textContent = playing ? "Pause" : "Play";
  }

  reseed() {
    this.page.reset(Math.floor(Math.random() * 2 ** 31));
  }

  choose(tool) {
    this.pointer.tool = tool;
    this.tools.set(tool);
  }

  show(mode) {
    this.page.setMode(mode);
    this.view.set(mode);
  }

  size(percent) {
    this.page.radius = (percent / 100) * this.page.studio.radius * this.page.surface.scale;
  }

  expose(stops) {
    this.page.studio.exposure = stops;
    this.page.changed = true;
  }
}
