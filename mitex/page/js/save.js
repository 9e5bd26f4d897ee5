// What is kept of the page: pictures, films and assets, as downloads.

const FILM_RATE = 30; // frames a second

function download(blob, name) {
  const link = element("a", { href: URL.createObjectURL(blob), download: name });
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 60_000);
}

// A file's name without what file systems refuse.
const fileName = (page, suffix) => `${`${page.look.name}-${page.surface.mesh.name}`.replace(/[^\w.-]+/g, "_")}${suffix}`;

function savePicture(page) {
  page.samples = FINEST;
  page.draw(); // in this task: the canvas is empty after it
  page.canvas.toBlob((blob) => download(blob, fileName(page, ".png")), "image/png");
}

async function saveAsset(page) {
  const side = page.surface.faceCount > 6000 ? 2048 : 1024;
  download(new Blob([await page.glb(side)], { type: "model/gltf-binary" }), fileName(page, ".glb"));
}

// A film of the canvas; null where the browser cannot record.
function startFilm(page) {
  const kind = ["video/mp4;codecs=avc1.42E01E", "video/webm;codecs=vp9", "video/webm"]
    .find((one) => window.MediaRecorder && MediaRecorder.isTypeSupported(one));
  if (!kind || !page.canvas.captureStream) return null;
  const recorder = new MediaRecorder(page.canvas.captureStream(FILM_RATE), { mimeType: kind, videoBitsPerSecond: 12e6 });
  const parts = [];
  recorder.ondataavailable = ({ data }) => parts.push(data);
  recorder.onstop = () => download(new Blob(parts, { type: kind }), fileName(page, kind.includes("mp4") ? ".mp4" : ".webm"));
  recorder.start();
  return recorder;
}
