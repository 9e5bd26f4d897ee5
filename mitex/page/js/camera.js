// A camera that orbits the object. Angles are those of `mitex render`: azimuth 0 sees the +z side, 90 the +x
// side [rad here].

const FIELD = (26 * Math.PI) / 180; // a portrait lens
const MARGIN = 0.1; // of the picture's half side, kept free

class Camera {
  constructor(points, radius) {
    Object.assign(this, { points, radius, azimuth: (25 * Math.PI) / 180, elevation: (18 * Math.PI) / 180 });
    this.fit();
  }

  // Back to where all points are seen, and the outermost ones at the margin.
  fit() {
    const { right, up, back } = this.axes();
    const slope = Math.tan(FIELD / 2) * (1 - MARGIN);
    let [reach, nearest] = [0, 0];
    const centre = [right, up].map((axis) => {
      let [high, low] = [-Infinity, -Infinity];
      for (let k = 0; k < this.points.length; k += 3) {
        const point = this.points.subarray(k, k + 3);
        const [across, ahead] = [dot(point, axis), dot(point, back)];
        high = Math.max(high, across + slope * ahead);
        low = Math.max(low, -across + slope * ahead);
        nearest = Math.max(nearest, ahead);
      }
      reach = Math.max(reach, (high + low) / 2 / slope);
      return (high - low) / 2;
    });
    this.distance = Math.max(reach, nearest + 0.1 * this.radius);
    this.target = plus(scaled(right, centre[0]), up, centre[1]);
  }

  axes() {
    const { azimuth: a, elevation: e } = this;
    const back = [Math.sin(a) * Math.cos(e), Math.sin(e), Math.cos(a) * Math.cos(e)];
    const right = [Math.cos(a), 0, -Math.sin(a)];
    return { right, up: cross(back, right), back };
  }

  get eye() {
    return plus(this.target, this.axes().back, this.distance);
  }

  // Slopes of the picture's sides; the field is that of the shorter side.
  slopes(aspect) {
    const slope = Math.tan(FIELD / 2);
    return [slope * Math.max(aspect, 1), slope / Math.min(aspect, 1)];
  }

  matrix(aspect) {
    const { right, up, back } = this.axes();
    const [near, far] = [Math.max(this.distance - 3 * this.radius, 0.02 * this.radius), this.distance + 3 * this.radius];
    const projection = perspective(this.slopes(aspect)[1], aspect, near, far);
    return times(projection, viewMatrix(this.eye, right, up, back));
  }

  turn(across, up) {
    this.azimuth -= across;
    this.elevation = clamp(this.elevation + up, -1.45, 1.45);
  }

  zoom(factor) {
    this.distance = clamp(this.distance * factor, 1.2 * this.radius, 20 * this.radius);
  }

  // Moves the target in the picture's plane, by shares of its height.
  pan(across, up) {
    const { right, up: upwards } = this.axes();
    const size = 2 * Math.tan(FIELD / 2) * this.distance;
    this.target = plus(plus(this.target, right, -across * size), upwards, up * size);
  }

  // A direction of the studio, which turns with the camera, in the object's space.
  studio([x, y, z]) {
    const [c, s] = [Math.cos(this.azimuth), Math.sin(this.azimuth)];
    return [x * c + z * s, y, -x * s + z * c];
  }
}
