// The panel: what can be done with the page, in sections.

const SPEEDS = [2, 5, 10, 20, 30, 60, 120, 240, 480]; // steps a second
const VIEWS = [
  ["light", "Light"], ["albedo", "Colour"], ["normal", "Normal"], ["height", "Height"],
  ["roughness", "Rough"], ["ambient_occlusion", "Occlusion"], ["graft", "Graft"],
];
const TOOLS = [
  ["turn", "Turn", "Drag to turn the object (T)"], ["erase", "Erase", "Wipe the texture off, and see it heal (E)"],
  ["graft", "Graft", "Paint the other texture (G)"],
];
const NONE = "none";
const FIELD_FILES = "NPY, or PLY with vx vy vz; or drop one onto the page";

class Panel {
  constructor(page, clock, pointer, { panel, status }) {
    Object.assign(this, { page, clock, pointer, place: panel, status });
    Object.assign(this, { grower: page.automaton ? page : null, stills: new Map() });
    this.build();
  }

  // All of it; what a look or a mesh does not have is left out.
  build() {
    const { page } = this;
    if (!page.automaton) {
      this._buildStill();
      return;
    }
    this.title = element("p", {}, `${page.look.name}, growing as you watch`);
    this.play = button("", "Pause or go on (space)", () => this.pause(), "main");
    this.place.replaceChildren(
      element("header", {}, element("h1", {}, page.surface.mesh.name), this.title),
      element("div", { className: "row" }, this.play,
        button("Regrow", "Back to the seed (R)", () => page.reset()),
        button("New seed", "The same look, another arrangement (N)", () => this.reseed())),
      ...this._training(), ...this._looks(), ...this._meshes(), this._hand(), this._texture(), ...this._motion(), this._view(), this._keep(), keysHelp(),
    );
    this.pause(this.clock.playing);
    this.choose(this.pointer.tool);
  }

  // Of an asset that does not grow.
  _buildStill() {
    const { page, place } = this;
    this.tools = this.brush = null;
    place.replaceChildren(element("header", {}, element("h1", {}, page.surface.mesh.name),
      element("p", {}, page.look.name)), ...this._looks(), this._view(), this._keep(), keysHelp());
  }

  _looks() {
    const { page, grower } = this;
    if (!grower) return [];
    const { looks, data: { thumbnails, stills = [] } } = grower;
    const names = [...looks.map(({ name }) => name), ...stills.map(({ look }) => look)];
    if (names.length < 2) return [];
    const chosen = page === grower ? grower.chosen : looks.length + stills.indexOf(page.data);
    const [pictures, act] = [[...thumbnails ?? [], ...stills.map(({ thumbnail }) => thumbnail)], (k) => this.look(k)];
    this.looks = thumbnails ? gallery(names, pictures, chosen, act)
      : choice("Look", names.map((name, k) => [k, name]), chosen, act);
    if (page !== grower) return [section("Look", this.looks)];
    const related = looks.map(({ name, family }, k) => [k, name, family])
      .filter(([k, , family]) => k !== page.chosen && family === page.look.family);
    const parts = [section("Look", this.looks)];
    if (!related.length) return parts;
    this.grafts = menu("Graft", [[NONE, "nothing"], ...related], page.grafted ?? NONE,
      (k) => this.graft(k === NONE ? NONE : Number(k)));
    this.share = slider("Everywhere", { low: 0, high: 100, step: 1, value: 0, text: (x) => `${x} %` },
      (x) => page.setShare(x / 100));
    this.share.hidden = page.grafted === null;
    return [...parts, section("Graft onto it", this.grafts, this.share)];
  }

  _meshes() {
    const { page } = this;
    const { meshes } = page.data;
    if (meshes.length < 2) return [];
    const shown = meshes.findIndex(({ name }) => name === page.base.name);
    return [section("Mesh", choice("Mesh", meshes.map(({ name }, k) => [k, name]), shown, (k) => {
      page.chooseMesh(k);
      this.build();
    }))];
  }

  // How far the training of a run is.
  _training() {
    if (!this.page.data.live) return [];
    this.loss = element("div", { className: "chart" });
    this.drawLoss();
    return [section("Training", this.loss)];
  }

  drawLoss() {
    const { loss } = this.page.data;
    const [step, value] = loss.at(-1) ?? [0, NaN];
    this.loss.replaceChildren(chart(loss), element("p", {}, `step ${step.toLocaleString()}, loss ${value.toPrecision(3)}`));
  }

  _hand() {
    const tools = TOOLS.filter(([key]) => key !== "graft" || this.page.grafted !== null);
    this.tools = choice("Tool", tools, this.pointer.tool, (tool) => this.choose(tool));
    this.brush = slider("Brush", { low: 2, high: 40, step: 1, value: 15, text: (x) => `${x} %` }, (x) => this.size(x));
    return section("Hand", this.tools, this.brush);
  }

  _texture() {
    const { page, clock } = this;
    return section("Texture",
      slider("Speed", { low: 0, high: SPEEDS.length - 1, step: 1, value: SPEEDS.indexOf(clock.rate),
        text: (k) => `${SPEEDS[k]} steps/s` }, (k) => { clock.rate = SPEEDS[k]; }),
      slider("Orientation", { low: -180, high: 180, step: 1, value: Math.round((page.turn * 180) / Math.PI),
        text: (x) => `${x}°` }, (x) => page.orient((x * Math.PI) / 180)),
      this._upwards(), this._subdivision());
  }

  // Orientation may be counted from a field instead of from +y.
  _upwards() {
    const { page } = this;
    return element("div", { className: "row" }, page.upwards
      ? button("Leave the field", "Count the orientation from +y again", () => {
        page.orient(page.turn, null);
        this.build();
      })
      : button("Along a field …", `Its up follows vectors at the mesh's vertices: ${FIELD_FILES}`, () => this.ask(UPWARDS)));
  }

  // Cells: each level of subdivision has four times as many, and patterns of half the size.
  _subdivision() {
    const { page } = this;
    const levels = [0, 1, 2, 3, 4, 5, 6].filter((k) => page.base.count * 4 ** k <= MOST_VERTICES);
    if (levels.length < 2) return "";
    const cells = (k) => `${Math.round((page.base.count * 4 ** k) / 100) / 10} k cells`;
    return slider("Subdivide", { low: 0, high: levels.at(-1), step: 1, value: page.levels, text: cells },
      (k) => page.setMesh(page.base, k));
  }

  // Where a texture moves that can.
  _motion() {
    const { page } = this;
    if (!page.look.condition && !page.look.carried) return [];
    const none = page.look.condition ? [] : [[null, "none"]];
    const given = Array.isArray(page.data.field) ? [[page.data.field, page.data.field.join(", ")]] : [];
    const own = page.base.fields[MOTION] ? [[MOTION, "the file's"]] : [];
    const names = FIELDS.map((name) => [name, name.replace("-", " ")]);
    const fields = choice("Direction", [...none, ...names, ...given, ...own], page.followed, (name) => {
      page.move(name, page.speed);
      fields.set(name);
    });
    const file = button("From a file …", `Vectors at the mesh's vertices: ${FIELD_FILES}`, () => this.ask(MOTION));
    return [section("Motion", fields, element("div", { className: "row" }, file), slider("Pace", { low: 0, high: 3, step: 0.1, value: page.speed,
      text: (x) => `${x.toFixed(1)} ×` }, (x) => page.move(page.field, x)))];
  }

  _view() {
    const { page } = this;
    const views = VIEWS.filter(([key]) =>
      key === "light" || page.look.maps[key] || (key === "graft" && page.grafted != null));
    this.view = choice("View", views, MODES[page.studio.mode], (mode) => this.show(mode));
    return section("View", this.view, slider("Exposure", { low: -2, high: 2, step: 0.1, value: page.studio.exposure,
      text: (x) => `${x > 0 ? "+" : ""}${x.toFixed(1)}` }, (x) => this.expose(x)));
  }

  _keep() {
    const { page } = this;
    this.film = button("Film", "Record until it is pressed again (F)", () => this.record());
    const another = page.automaton ? [button("Open a mesh …", "OBJ, PLY or GLB; or drop one onto the page (O)",
      () => this.ask())] : [];
    return section("Keep", element("div", { className: "row" },
      button("Picture", "Save what is shown (S)", () => savePicture(page)), this.film,
      button("GLB", "Save the mesh with the texture as it is now", () => this.attempt(() => saveAsset(page))),
      ...another));
  }

  pause(playing = !this.clock.playing) {
    this.clock.playing = playing;
    this.play.textContent = playing ? "Pause" : "Play";
  }

  reseed() {
    this.page.reset(Math.floor(Math.random() * 2 ** 31));
  }

  choose(tool) {
    if (!this.tools || (tool === "graft" && this.page.grafted === null)) return;
    this.pointer.tool = tool;
    this.tools.set(tool);
  }

  // One of the looks, or of the assets that stand still beside them.
  async look(chosen) {
    const { grower } = this;
    const still = chosen - grower.looks.length;
    if (still >= 0) {
      this._turnTo(await this._still(still));
      return;
    }
    if (this.page !== grower) this._turnTo(grower);
    grower.setLook(chosen);
    if (this.pointer.tool === "graft") this.pointer.tool = "turn";
    this.build();
  }

  async _still(k) {
    const { data, graphics, studio } = this.grower;
    if (!this.stills.has(k)) this.stills.set(k, await StillPage.of(data.stills[k], graphics, studio));
    return this.stills.get(k);
  }

  // Shows another page in place of the one that is there.
  _turnTo(page) {
    [this, this.clock, this.pointer].forEach((one) => { one.page = page; });
    this.pointer.tool = "turn";
    page.enter();
    page.setMode("light");
    this.build();
  }

  graft(chosen) {
    this.page.setGraft(chosen === NONE ? null : chosen);
    this.pointer.tool = chosen === NONE ? "turn" : "graft";
    this.build();
  }

  show(mode) {
    this.page.setMode(mode);
    this.view.set(mode);
  }

  size(percent) {
    this.brush.set(percent);
    this.page.radius = (percent / 100) * this.page.studio.radius * this.page.surface.scale;
  }

  expose(stops) {
    this.page.studio.exposure = stops;
    this.page.changed = true;
  }

  record() {
    if (this.recorder) {
      this.recorder.stop();
      this.recorder = null;
    } else {
      this.recorder = startFilm(this.page);
      if (!this.recorder) this.say("This browser cannot record films.");
    }
    this.film.textContent = this.recorder ? "Stop" : "Film";
  }

  // Grows the texture on a mesh of the user's, or lets it follow vectors at the vertices of the one that is there.
  open(file, led = this.page.followed ? MOTION : UPWARDS) {
    const { page } = this;
    if (!file || !page.automaton) return;
    this.attempt(async () => {
      const { mesh, vectors } = readFile(new Uint8Array(await file.arrayBuffer()), file.name);
      if (vectors && (!mesh || fits(vectors, page.base))) page.follow(led, vectorsOf(page.base, vectors, file.name));
      else {
        if (vectors) mesh.fields[led] = vectorsOf(mesh, vectors, file.name);
        page.setMesh(mesh, autoLevels(mesh.count));
      }
      this.build();
    });
  }

  // Asks for a file of a mesh or, for what is led, of vectors.
  ask(led) {
    const accept = led ? ".npy,.ply" : ".obj,.ply,.glb";
    const input = element("input", { type: "file", accept, onchange: () => this.open(input.files[0], led) });
    input.click();
  }

  async attempt(act) {
    try {
      await act();
    } catch (error) {
      this.say(error.message);
    }
  }

  say(text) {
    this.status.textContent = text;
    this.clock.quietUntil = performance.now() + 6000;
  }
}
