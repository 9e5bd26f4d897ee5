// When steps are taken and pictures drawn: steps at the rate that is asked for as far as the device can,
// pictures only when something has changed, finer ones when it has stopped.

const MOST_STEPS = 16; // in a frame
const FINEST = 2; // samples along a side of a pixel

class Clock {
  constructor(page, whenDrawn) {
    Object.assign(this, { page, whenDrawn, playing: Boolean(page.automaton), rate: 30, due: 0, drawn: 0, taken: 0, since: 0, quietUntil: 0 });
  }

  start() {
    this.frame = this.frame.bind(this);
    requestAnimationFrame(this.frame);
  }

  frame(now) {
    const passed = Math.min((now - (this.last ?? now)) / 1000, 0.25);
    this.last = now;
    const { page } = this;
    if (this.playing && page.automaton && !page.automaton.busy) {
      this.due = Math.min(this.due + this.rate * passed, MOST_STEPS);
      // A device that is slow at drawing shall not be asked for many steps, too.
      const steps = Math.min(Math.floor(this.due), passed > 0.1 ? 2 : MOST_STEPS);
      this.due = passed > 0.1 ? 0 : this.due - steps;
      if (steps) page.step(steps);
      this.taken += steps;
    }
    if (page.changed) this._draw(1, now);
    else if (page.samples < FINEST && now - this.stopped > 200 && this.cost < 300) this._draw(FINEST, now);
    if (now - this.since > 1000) this._count(now);
    requestAnimationFrame(this.frame);
  }

  _draw(samples, now) {
    const begun = performance.now();
    this.page.samples = samples;
    this.page.draw();
    this.cost = performance.now() - begun;
    if (samples === 1) this.stopped = now;
    this.drawn++;
  }

  _count(now) {
    const seconds = (now - this.since) / 1000;
    if (now > this.quietUntil) this.whenDrawn({ frames: this.drawn / seconds, steps: this.taken / seconds });
    Object.assign(this, { since: now, drawn: 0, taken: 0 });
  }
}
