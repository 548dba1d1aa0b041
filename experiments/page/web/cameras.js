// What both cameras saw, with the estimated marker as circles: the inner one dotted, in the ball's colour.

import {h} from 'page/dom.js';
import {inverse, transform} from 'page/series.js';
import {onTheme} from 'page/theme.js';

const kSides = ['left', 'right'];

export class Cameras {
  constructor(host, trial) {
    this.trial = trial;
    this.pictures = {};
    this.pose = null;
    this.trusted = true;
    this.views = {};
    this.caption = h('p', {class: 'note', 'aria-live': 'off'});
    this.element = h(
      'div',
      {class: 'cameras'},
      kSides.map(side => {
        const canvas = h('canvas', {
          width: trial.rig.width_px,
          height: trial.rig.height_px,
          role: 'img',
          'aria-label': `${side} camera with the estimated marker`,
        });
        this.views[side] = canvas;
        return h('figure', {}, canvas, h('figcaption', {}, side));
      }),
    );
    host.append(this.element, this.caption);
    onTheme(() => this.draw());
    this.draw();
  }

  /** An image, a bitmap or a canvas of that camera; null for none. */
  setPicture(side, picture) {
    this.pictures[side] = picture;
    this.draw();
  }
  /** The estimate that belongs to the pictures, a pose of M in H; trusted: F is above detection. */
  setEstimate(pose, trusted = true) {
    this.pose = pose;
    this.trusted = trusted;
    this.draw();
  }
  say(text) {
    if (this.caption.textContent !== text) this.caption.textContent = text;
  }

  /** Circles of the balls in one camera: [{u, v, radius, rgb}], in pixels. */
  circles(side) {
    const camera = this.trial.rig[side];
    return !this.pose
      ? []
      : this.trial.marker.balls
          .map(ball => {
            const [x, y, z] = transform(inverse(camera.X_HC), transform(this.pose, ball.p_m));
            return z < 1e-3
              ? null
              : {
                  u: (camera.fx_px * x) / z + camera.cx_px,
                  v: (camera.fy_px * y) / z + camera.cy_px,
                  radius: (camera.fx_px * ball.radius_m) / z,
                  rgb: ball.rgb,
                };
          })
          .filter(Boolean);
  }

  draw() {
    if (this.pending) return;
    this.pending = true;
    requestAnimationFrame(() => {
      this.pending = false;
      kSides.forEach(side => this.drawSide(side));
    });
  }
  drawSide(side) {
    const canvas = this.views[side];
    const c = canvas.getContext('2d');
    const {width, height} = canvas;
    c.fillStyle = '#0a1218';
    c.fillRect(0, 0, width, height);
    const picture = this.pictures[side];
    if (picture) c.drawImage(picture, 0, 0, width, height);
    const unit = width / 640;
    c.globalAlpha = this.trusted ? 1 : 0.55;
    for (const {u, v, radius, rgb} of this.circles(side)) {
      c.strokeStyle = `rgb(${rgb.map(x => Math.round(255 * x)).join(' ')})`;
      c.lineWidth = 2.4 * unit;
      c.setLineDash([4 * unit, 4 * unit]);
      c.beginPath();
      c.arc(u + 0.5, v + 0.5, radius, 0, 2 * Math.PI);
      c.stroke();
      c.strokeStyle = '#fff';
      c.lineWidth = 1.3 * unit;
      c.setLineDash([]);
      c.beginPath();
      c.arc(u + 0.5, v + 0.5, radius * this.trial.marker.outer_ring_ratio, 0, 2 * Math.PI);
      c.stroke();
    }
    c.globalAlpha = 1;
  }
}
