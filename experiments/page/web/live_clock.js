// The time of a live page: the program's, or one that somebody looks back at; and the pictures kept for that.

import {Clock} from 'page/clock.js';

const kKeepEvery_frames = 6;
const kMostKept = 600; // some 50 MB

/** Play and pause are the program's, looking back is the page's own. */
export class LiveClock extends Clock {
  /** send(command): to the program. */
  constructor(send) {
    super();
    this.send = send;
    this.follow = true;
  }
  toggle() {
    this.follow = !this.ended;
    if (!this.ended) this.send({do: this.playing ? 'pause' : 'go'});
    else if (this.playing) super.pause();
    else this.play(); // over again, from the page's own memory
  }
  /** The program's time again. */
  catchUp() {
    if (this.ended) super.pause();
    this.follow = true;
    this.seek(this.end);
  }
  pause() {} // looking back stops nothing
  setSpeed(factor) {
    super.setSpeed(factor);
    this.send({do: 'speed', factor});
  }
  /** As the program says; whether that is new. */
  set({going, ended, speed}) {
    const playing = ended ? this.playing && this.ended : going;
    const isNew = ended !== this.ended || playing !== this.playing || speed !== this.speed;
    Object.assign(this, {ended, speed, playing});
    if (isNew) this.tell();
    return isNew;
  }
}

/** The last pictures of a trial, a few a second: {frame, left, right}. */
export class Film {
  constructor() {
    this.pictures = [];
  }
  add(picture) {
    const last = this.pictures[this.pictures.length - 1];
    if (last && picture.frame < last.frame + kKeepEvery_frames) return;
    this.pictures.push(picture);
    if (this.pictures.length > kMostKept) this.pictures.shift();
  }
  /** The one nearest to a frame, or `other`. */
  nearest(frame, other) {
    const late = picture => Math.abs(picture.frame - frame);
    return this.pictures.reduce((best, next) => (late(next) < late(best) ? next : best), other);
  }
}
