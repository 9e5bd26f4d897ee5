// How a loss falls: a line in a small drawing.

const [CHART_WIDTH, CHART_HEIGHT] = [260, 84];
const SVG = "http://www.w3.org/2000/svg";

// Points are [step, loss] pairs; the losses are drawn by their logarithms if all are above 0.
function chart(points) {
  const drawing = document.createElementNS(SVG, "svg");
  drawing.setAttribute("viewBox", `0 0 ${CHART_WIDTH} ${CHART_HEIGHT}`);
  drawing.setAttribute("role", "img");
  const last = points.at(-1);
  drawing.setAttribute("aria-label", last ? `The loss after ${last[0]} steps is ${last[1].toPrecision(3)}` : "No loss yet");
  if (points.length < 2) return drawing;
  const scale = points.every(([, loss]) => loss > 0) ? Math.log : (x) => x;
  const losses = points.map(([, loss]) => scale(loss));
  const [low, high] = [Math.min(...losses), Math.max(...losses)];
  const place = (k) => [
    ((points[k][0] - points[0][0]) / (last[0] - points[0][0] || 1)) * CHART_WIDTH,
    4 + ((high - losses[k]) / (high - low || 1)) * (CHART_HEIGHT - 8),
  ].map((x) => x.toFixed(1)).join(",");
  const line = document.createElementNS(SVG, "polyline");
  line.setAttribute("points", points.map((_, k) => place(k)).join(" "));
  drawing.append(line);
  return drawing;
}
