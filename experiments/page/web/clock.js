// The time that traces, pictures and the 3D scene show together.

export class Clock {
  /** Times in s. A live page sets `end` as it grows; `follow` keeps the time there. */
  constructor({start = 0, end = 0} = {}) {
    this.start = start;
    this.end = end;
    this.time = start;
    this.speed = 1;
    this.playing = false;
    this.follow = false;
    this.listeners = new Set();
  }

  /** Calls listener(clock) after every change; returns what ends that. */
  on(listener) {
    this.listeners.add(listener);
    return () => this.listeners.delete(listener);
  }
  tell() {
    for (const listener of this.listeners) listener(this);
  }

  seek(time) {
    this.time = Math.min(Math.max(time, this.start), this.end);
    this.tell();
  }
  /** A time that somebody picked: not the end any more. */
  lookAt(time) {
    this.follow = false;
    this.seek(time);
  }
  setEnd(end) {
    this.end = end;
    if (this.follow) this.time = end;
    this.tell();
  }
  setSpeed(speed) {
    this.speed = speed;
    this.tell();
  }

  play() {
    if (this.playing) return;
    if (this.time >= this.end) this.time = this.start;
    this.playing = true;
    let before = performance.now();
    const step = now => {
      if (!this.playing) return;
      this.time += (this.speed * (now - before)) / 1000;
      before = now;
      if (this.time >= this.end) {
        this.time = this.end;
        this.playing = false;
      }
      this.tell();
      this.frame = requestAnimationFrame(step);
    };
    this.frame = requestAnimationFrame(step);
    this.tell();
  }
  pause() {
    this.playing = false;
    cancelAnimationFrame(this.frame);
    this.tell();
  }
  toggle() {
    this.playing ? this.pause() : this.play();
  }
}
