// Steps by a compute shader, where a browser has WebGPU. Pictures are drawn in WebGL2: after some steps the
// states are brought there, and no further ones are begun before they have arrived.

const BATCH = 16; // steps whose numbers are sent at once
const TILE = 32; // cells that update together
const APART = 256; // of the parts of a uniform buffer [bytes]

class ComputeAutomaton extends Automaton {
  constructor(graphics, surface, look, device) {
    super(graphics, surface, look, Infinity);
    const plane = 16 * WIDTH * surface.height;
    this.size = this.shape.vectors * plane;
    this.buffers = {
      rows: storageBuffer(device, plane), links: filledBuffer(device, surface.linkValues),
      shares: storageBuffer(device, plane / 4), condition: storageBuffer(device, plane),
      numbers: emptyBuffer(device, APART * BATCH, "UNIFORM", "COPY_DST"),
      arrival: emptyBuffer(device, this.size, "MAP_READ", "COPY_DST"),
    };
    device.queue.writeBuffer(this.buffers.rows, 0, surface.rowValues);
    this.pair = [storageBuffer(device, this.size), storageBuffer(device, this.size)]; // states before and after a step
    Object.assign(this, { device, turn: surface.turn, waiting: 0, version: 0, erased: [] });
    this.setLooks(look);
    this.reset(0);
  }

  // The look whose rule the cells follow, and another one that may be grafted onto it.
  setLooks(look, other = null) {
    const { device, shape } = this;
    const rules = Object.entries(other ? { rule: look, other } : { rule: look });
    const names = rules.map(([rule]) => rule);
    this.look = look;
    this._dropWeights();
    this.weights = Object.fromEntries(rules.map(([rule, one]) =>
      [`${rule}0`, filledBuffer(device, shape.weights(one)[0])]));
    const bounds = rules.flatMap(([rule, one]) => Object.values(shape.bounds(one, rule)).flatMap((x) => [...x]));
    this.weights.bounds = filledBuffer(device, Float32Array.from(bounds), "UNIFORM");
    this._bind(computePipeline(device, computeStep(shape, names, device.cellsPerThread)), names);
  }

  _bind(pipeline, names) {
    const { device, buffers, weights, shape, pair } = this;
    const directions = [pair, pair.toReversed()].map(([states, following]) => {
      const given = { ...buffers, ...weights, states, following };
      return bindGroup(device, pipeline, 0, bindings(shape, names).map(([name]) => given[name]));
    });
    const numbers = Array.from({ length: BATCH }, (_, k) =>
      bindGroup(device, pipeline, 1, [{ buffer: buffers.numbers, offset: APART * k, size: 12 }]));
    Object.assign(this, { pipeline, directions, numbers });
  }

  // What carries the states after each step, of `advectionOf`; null for nothing.
  carry(advection) {
    const { device, shape } = this;
    this._letGo();
    if (!advection) return;
    const pipeline = computePipeline(device, written(SHADERS["carry.wgsl"], { CONSTANTS: `const VECTORS = ${shape.vectors}u;` }));
    const sources = storageBuffer(device, 16 * this._plane);
    device.queue.writeBuffer(sources, 0, advection.sources);
    const buffers = [sources, filledBuffer(device, advection.parts)];
    // In the order of the pair's directions as they are now.
    const directions = [this.pair, this.pair.toReversed()].map((states) =>
      bindGroup(device, pipeline, 0, [...buffers, ...states]));
    this.carrying = { pipeline, buffers, directions };
  }

  get _plane() {
    return WIDTH * this.surface.height;
  }

  get busy() {
    return this.waiting > 0;
  }

  // Takes steps; the states can be drawn when the promise is kept.
  advance(count) {
    const begun = this.waiting ? this.arriving.then(() => this._advance(count)) : this._advance(count);
    this.waiting++;
    this.arriving = begun.finally(() => { this.waiting--; });
    return this.arriving;
  }

  async _advance(count) {
    const { device, buffers, size, version } = this;
    for (let taken = 0; taken < count; taken += BATCH) this._submit(Math.min(count - taken, BATCH));
    const commands = device.createCommandEncoder();
    commands.copyBufferToBuffer(this.pair[0], 0, buffers.arrival, 0, size);
    device.queue.submit([commands.finish()]);
    this.erased = [];
    const arrived = await buffers.arrival.mapAsync(GPUMapMode.READ).then(() => true, () => false);
    if (!arrived) return; // the device is lost, or the cells are no longer needed
    if (version === this.version) {
      this._show(new Float32Array(buffers.arrival.getMappedRange()));
      this.erased.forEach((slots) => super._clear(slots)); // since these steps were begun
    }
    buffers.arrival.unmap();
  }

  _submit(count) {
    const { device, buffers, surface } = this;
    if (this.turn !== surface.turn) device.queue.writeBuffer(buffers.links, 0, surface.linkValues);
    this.turn = surface.turn;
    device.queue.writeBuffer(buffers.numbers, 0, this._numbers(count));
    const commands = device.createCommandEncoder();
    const pass = commands.beginComputePass();
    for (let k = 0; k < count; k++) {
      this._pass(pass, this.pipeline, this.directions[0], this.numbers[k]);
      if (this.carrying) this._pass(pass, this.carrying.pipeline, this.carrying.directions[0]);
    }
    pass.end();
    device.queue.submit([commands.finish()]);
    this.steps += count;
  }

  // New states of all cells from the present ones.
  _pass(pass, pipeline, ...groups) {
    pass.setPipeline(pipeline);
    groups.forEach((group, k) => pass.setBindGroup(k, group));
    pass.dispatchWorkgroups(this._plane / TILE);
    this.pair.reverse();
    this.directions.reverse();
    this.carrying?.directions.reverse();
  }

  // What the shader knows of each step.
  _numbers(count) {
    const words = new Uint32Array((APART / 4) * count);
    const numbers = new Float32Array(words.buffer);
    for (let k = 0; k < count; k++) {
      words.set([phaseOf(this.steps + k, this.seed), this._plane], (APART / 4) * k);
      numbers[(APART / 4) * k + 2] = this.look.mean ? 6 : 0;
    }
    return words;
  }

  write(values) {
    const planes = this._planes(values);
    this.version++; // steps that are on their way bring states of before
    this.device.queue.writeBuffer(this.pair[0], 0, planes);
    this._show(planes);
  }

  share(values) {
    super.share(values);
    this.device.queue.writeBuffer(this.buffers.shares, 0, values);
  }

  tell(values) {
    super.tell(values);
    this.device.queue.writeBuffer(this.buffers.condition, 0, values);
  }

  _clear(slots) {
    super._clear(slots);
    this.erased.push(slots);
    const clearing = computePipeline(this.device, written(SHADERS["clear.wgsl"],
      { CONSTANTS: `const VECTORS = ${this.shape.vectors}u;` }));
    const list = filledBuffer(this.device, slots);
    const commands = this.device.createCommandEncoder();
    const pass = commands.beginComputePass();
    pass.setPipeline(clearing);
    pass.setBindGroup(0, bindGroup(this.device, clearing, 0, [this.pair[0], list]));
    pass.dispatchWorkgroups(Math.ceil(slots.length / TILE));
    pass.end();
    this.device.queue.submit([commands.finish()]);
    list.destroy();
  }

  _letGo() {
    this.carrying?.buffers.forEach((one) => one.destroy());
    this.carrying = null;
  }

  _dropWeights() {
    Object.values(this.weights ?? {}).forEach((one) => one.destroy());
  }

  drop() {
    this.version++;
    this._dropWeights();
    this._letGo();
    [...this.pair, ...Object.values(this.buffers)].forEach((one) => one.destroy());
    super.drop();
  }
}
