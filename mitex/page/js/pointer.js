// Hands on the picture: a drag turns the object or, with a brush, changes it; beside the object it always
// turns. The wheel and two fingers zoom, the right button moves.

class Pointer {
  constructor(page, cursor) {
    Object.assign(this, { page, cursor, tool: "turn", fingers: new Map() });
    const { canvas } = page;
    const on = (name, act) => canvas.addEventListener(name, act.bind(this), { passive: false });
    on("pointerdown", this._down);
    on("pointermove", this._move);
    on("pointerup", this._up);
    on("pointercancel", this._up);
    on("pointerleave", () => { cursor.hidden = true; });
    on("contextmenu", (event) => event.preventDefault());
    on("wheel", (event) => {
      event.preventDefault();
      this._zoom(Math.exp(0.0012 * event.deltaY));
    });
    on("dblclick", () => {
      page.studio.camera.fit();
      page.changed = true;
    });
  }

  _down(event) {
    const { page } = this;
    page.canvas.setPointerCapture(event.pointerId);
    page.canvas.focus({ preventScroll: true });
    this.fingers.set(event.pointerId, [event.clientX, event.clientY]);
    const point = this.tool !== "turn" && event.button === 0 && this.fingers.size === 1 ? this._point(event) : null;
    this.doing = point ? "brush" : event.button === 2 || event.ctrlKey ? "pan" : "turn";
    if (point) this.brush(point);
  }

  _move(event) {
    const before = this.fingers.get(event.pointerId);
    if (!before) {
      this._hover(event);
      return;
    }
    const [x, y] = [event.clientX - before[0], event.clientY - before[1]];
    if (this.fingers.size === 2) this._pinch(event, x, y);
    else if (this.doing === "brush") {
      const point = this._point(event);
      if (point) this.brush(point);
      this._hover(event);
    } else this._drag(x, y);
    this.fingers.set(event.pointerId, [event.clientX, event.clientY]);
  }

  _up(event) {
    this.fingers.delete(event.pointerId);
  }

  _drag(x, y) {
    const { camera } = this.page.studio;
    const side = Math.min(this.page.canvas.clientWidth, this.page.canvas.clientHeight);
    if (this.doing === "pan") camera.pan(x / side, y / side);
    else camera.turn((4 * x) / side, (4 * y) / side);
    this.page.changed = true;
  }

  _pinch(event, x, y) {
    const [other] = [...this.fingers].filter(([id]) => id !== event.pointerId).map(([, place]) => place);
    const before = this.fingers.get(event.pointerId);
    const apart = (place) => Math.hypot(place[0] - other[0], place[1] - other[1]);
    this._zoom(apart(before) / Math.max(apart([event.clientX, event.clientY]), 1));
    const side = Math.min(this.page.canvas.clientWidth, this.page.canvas.clientHeight);
    this.page.studio.camera.pan(x / side / 2, y / side / 2);
  }

  _zoom(factor) {
    this.page.studio.camera.zoom(factor);
    this.page.changed = true;
  }

  // The point of the surface under the pointer.
  _point(event) {
    const { canvas } = this.page;
    const box = canvas.getBoundingClientRect();
    const [x, y] = [(event.clientX - box.left) / box.width, (event.clientY - box.top) / box.height];
    return this.page.pick(x * canvas.width, y * canvas.height);
  }

  // A circle of the brush's size where the pointer is.
  _hover(event) {
    const { page, cursor } = this;
    cursor.hidden = this.tool === "turn" || event.pointerType === "touch";
    if (cursor.hidden) return;
    const box = page.canvas.getBoundingClientRect();
    const { camera, radius: extent } = page.studio;
    const radius = page.radius / page.surface.scale;
    const slope = camera.slopes(box.width / box.height)[1] * Math.max(camera.distance - 0.7 * extent, 0.1 * extent);
    const size = (radius / slope) * box.height;
    Object.assign(cursor.style, { width: `${size}px`, height: `${size}px`,
      left: `${event.clientX - box.left}px`, top: `${event.clientY - box.top}px` });
  }

  brush(point) {
    if (this.tool === "erase") this.page.erase(point);
    if (this.tool === "graft") this.page.graft(point);
  }
}
