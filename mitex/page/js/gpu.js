// WebGPU in few words: a device, buffers, pipelines and what they are given.

// The device that steps are computed on; null for WebGL2. `wanted` is webgl or webgpu; else it is WebGPU, unless
// that is a processor where WebGL2 has a graphics card.
async function computeDevice(wanted, graphics) {
  if (wanted === "webgl") return null;
  const device = await anyDevice(wanted === "webgpu" || graphics.software).catch(() => null);
  if (wanted === "webgpu" && !device) throw new Error("this browser has no WebGPU");
  return device;
}

async function anyDevice(evenProcessors) {
  const adapter = await navigator.gpu?.requestAdapter();
  if (!adapter || (adapter.info.isFallbackAdapter && !evenProcessors)) return null;
  // On a processor reading the weights costs most, and cells of one thread share it; a graphics card wants threads.
  return Object.assign(await adapter.requestDevice(), { cellsPerThread: adapter.info.isFallbackAdapter ? 8 : 1 });
}

function emptyBuffer(device, size, ...uses) {
  const usage = uses.reduce((sum, use) => sum | GPUBufferUsage[use], 0);
  return device.createBuffer({ size: 4 * Math.ceil(size / 4), usage });
}

const storageBuffer = (device, size) => emptyBuffer(device, size, "STORAGE", "COPY_DST", "COPY_SRC");

function filledBuffer(device, values, use = "STORAGE") {
  const buffer = emptyBuffer(device, Math.max(values.byteLength, 16), use, "COPY_DST");
  device.queue.writeBuffer(buffer, 0, values);
  return buffer;
}

// Pipelines are kept, as programs are.
function computePipeline(device, code) {
  device.pipelines ??= new Map();
  if (!device.pipelines.has(code)) {
    const compute = { module: device.createShaderModule({ code }) };
    device.pipelines.set(code, device.createComputePipeline({ layout: "auto", compute }));
  }
  return device.pipelines.get(code);
}

// Buffers, or parts of them, in the order of their bindings.
function bindGroup(device, pipeline, index, resources) {
  return device.createBindGroup({ layout: pipeline.getBindGroupLayout(index),
    entries: resources.map((one, binding) => ({ binding, resource: one.buffer ? one : { buffer: one } })) });
}
